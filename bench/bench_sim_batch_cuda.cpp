// SPDX-License-Identifier: Apache-2.0
// Calls of a batch simulator on a GPU, at the image sizes at which agents are trained.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device_time.hpp"
#include "error.hpp"
#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/eval.hpp"
#include "gsnav/open.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "samples.hpp"

namespace {

using namespace gsnav;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kFlats = 4, kEnvironments = 256, kJudged = 4;
enum Profile : std::int64_t { kFast, kVisible, kLod, kBodies };
const char* const kProfiles[] = {"fast", "fast with visible sets", "lod", "fast with levels of bodies"};

std::vector<SensorSpec> sensors(int side, bool rgb) {
  std::vector<SensorSpec> all = rgbd_sensors(side, side);
  if (!rgb) all.erase(all.begin());
  return all;
}

using Flats = std::vector<std::shared_ptr<const SimulatorScene>>;

/// Four copies of the embedded flat with five people, each with arrays of its own, levels of detail and
/// visible sets for a sensor of `side` pixels.
Flats make_flats(int side) {
  OpenOptions options;
  options.device = Device::parse("cuda").value();
  options.navmesh = "auto";
  options.levels = SceneLevels::built;
  options.visible_sets = "auto";
  options.people = 5;
  options.eye = Camera::look_at({0, 1.5, 0}, {0, 1.5, -1}, {0, 1, 0}, side, side, 90);
  const OpenedScene opened = open_scene("default", options).value();
  for (const std::string& line : opened.notes) std::fprintf(stderr, "%s\n", line.c_str());
  Flats flats;
  for (std::size_t i = 0; i < kFlats; ++i) {
    SimulatorScene copy = *opened.scene;
    for (SceneAsset& a : copy.assets) a.cloud = std::make_shared<const GaussianCloud>(*a.cloud);
    flats.push_back(std::make_shared<const SimulatorScene>(std::move(copy)));
  }
  return flats;
}

/// Flats of make_flats(), with or without their people.
Flats flats_for(int side, bool people) {
  static std::map<int, Flats> kept;
  if (kept.find(side) == kept.end()) kept[side] = make_flats(side);
  Flats flats = kept[side];
  if (people) return flats;
  for (auto& flat : flats) {
    SimulatorScene alone = *flat;
    alone.avatars.clear();
    flat = std::make_shared<const SimulatorScene>(std::move(alone));
  }
  return flats;
}

/// Error of the images of kJudged environments.
struct Judged {
  double psnr = std::numeric_limits<double>::quiet_NaN(), depth_p99 = psnr;
};

/// Float64 images of environments 0, 4, 8, ..., all in the first flat: what the contract draws, or a
/// photo of four times the resolution. People are posed in float32, as in the simulator. Rows with the
/// same size and people begin with the same episodes, so that they share the images.
template <class Batch>
const eval::OracleFrames& truth_of(const Batch& sim, const std::shared_ptr<const SimulatorScene>& scene,
                                   const SensorSpec& sensor, bool photo) {
  static std::map<std::array<std::size_t, 3>, eval::OracleFrames> kept;
  eval::OracleFrames& all = kept[{static_cast<std::size_t>(sensor.resolution[1]), scene->avatars.size(),
                                  photo ? std::size_t{1} : std::size_t{0}}];
  if (!all.rgb.empty()) return all;
  OpenMPBackend cpu;
  SceneOnBackend<OpenMPBackend> whole(cpu, scene);
  const Device device = Device::parse("cpu").value();
  eval::OracleConfig config;
  config.order = eval::OracleOrder::float32_key;
  for (std::size_t e = 0; e < kJudged; ++e) {
    const World& world = sim.world(kFlats * e);
    whole.pose(0, world.time()).throw_if_error();
    const AgentPose& agent = world.agent();
    const Camera camera = sensor_camera(sensor, agent.position, agent.rotation(), agent.pitch);
    const eval::OracleFrames one =
        photo ? eval::oracle_photo(device, whole.sets(0), camera, 4, config).value()
              : eval::oracle_render(device, whole.sets(0), camera, config).value();
    all.rgb.insert(all.rgb.end(), one.rgb.begin(), one.rgb.end());
    all.alpha.insert(all.alpha.end(), one.alpha.begin(), one.alpha.end());
    all.median_depth.insert(all.median_depth.end(), one.median_depth.begin(), one.median_depth.end());
  }
  return all;
}

Judged judge(CudaBackend& cuda, const BatchStep& step, const eval::OracleFrames& truth) {
  Judged judged;
  for (const BatchObservation& o : step.images) {
    const auto floats = static_cast<std::size_t>(o.height * o.width * o.channels);
    std::vector<float> image(kJudged * floats), seen;
    std::vector<double> expected;
    for (std::size_t e = 0; e < kJudged; ++e) {
      cuda.copy(image.data() + e * floats, o.on_backend + kFlats * e * floats, floats * sizeof(float),
                CopyKind::device_to_host);
    }
    cuda.synchronize().throw_if_error();
    if (o.kind == SensorKind::rgb) {
      judged.psnr = gsnav_bench::error_of(image, truth.rgb).psnr;
      continue;
    }
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (truth.alpha[i] <= 0.9) continue;
      seen.push_back(image[i]);
      expected.push_back(truth.median_depth[i]);
    }
    judged.depth_p99 = gsnav_bench::error_of(seen, expected).p99;
  }
  return judged;
}

/// The renderer alone, for the same frames.
class Alone {
 public:
  Alone(CudaBackend& cuda, const Flats& scenes, int side, bool rgb)
      : renderer_(cuda, RenderConfig{.quality = Quality::fast()}), memory_(cuda), device_(cuda) {
    for (std::size_t i = 0; i < kFlats; ++i) {
      for (const SceneAsset& a : scenes[i]->assets) {
        sets_of_[i].push_back(static_cast<std::uint32_t>(sets_.size()));
        sets_.push_back(arrays_.emplace_back(cuda, *a.cloud).set(a.world_from_asset));
      }
    }
    const std::size_t pixels = kEnvironments * static_cast<std::size_t>(side * side);
    memory_.resize_discard(4 * pixels);
    images_.floats.median_depth = memory_.data();
    if (rgb) images_.floats.rgb = memory_.data() + pixels;
  }

  /// Draws what the environments see. Returns the device's time, microseconds.
  double draw(const BasicBatchSimulator<CudaBackend>& sim, const SensorSpec& sensor) {
    const double us = device_.us([&] {
      std::vector<BatchCamera> cameras;
      for (std::size_t e = 0; e < kEnvironments; ++e) {
        const AgentPose& agent = sim.world(e).agent();
        cameras.push_back({sensor_camera(sensor, agent.position, agent.rotation(), agent.pitch),
                           sets_of_[e % kFlats]});
      }
      renderer_.render(sets_, cameras, images_).throw_if_error();
    });
    renderer_.finish().throw_if_error();
    return us;
  }

 private:
  CudaBatchRenderer renderer_;
  std::vector<GaussianArrays<CudaBackend>> arrays_;
  std::vector<GaussianSet> sets_;
  std::array<std::vector<std::uint32_t>, kFlats> sets_of_;
  Buffer<float, CudaBackend> memory_;
  BatchImages images_;
  gsnav_bench::DeviceTime device_;
};

/// BasicBatchSimulator::step() of 256 environments over four flats, with random actions. Images are left
/// on the device. The time is that of the call, and the label names the profile.
///
/// Arguments: side in pixels, whether RGB is drawn beside depth, people in each flat, profile. With
/// people, each environment is at a time of its own.
///
/// Counters: `ms` and `p90_ms` of the calls, `steps/s`, and `world_ms`, which is a call without images.
/// `draw_ms` is what the renderer takes on the device for the same frames (`fast`, without people).
/// `psnr` and `depth_p99` (metres) compare four environments after the reset with float64: levels of
/// detail with photos, and the other profiles with images of the contract.
void step_batch_cuda(benchmark::State& state) {
  if (CudaBackend::device_count() == 0) {
    state.SkipWithError("no GPU");
    return;
  }
  const int side = static_cast<int>(state.range(0));
  const bool people = state.range(2) != 0;
  const std::int64_t profile = state.range(3);
  state.SetLabel(kProfiles[profile]);
  const Flats scenes = flats_for(side, people);
  CudaBackend cuda;
  BatchConfig config;
  config.sensors = sensors(side, state.range(1) != 0);
  config.images = ImageMemory::backend;
  config.render.quality = Quality::fast();
  config.visible_sets = profile == kVisible;
  if (profile == kLod || profile == kBodies) config.lod = LodChoice{.bodies_only = profile == kBodies};
  config.pose_slots = kEnvironments / kFlats;
  if (people) config.task = TaskConfig::avatar_pointnav();
  const auto episode_of = [&](std::size_t e, std::size_t count) -> Result<BatchEpisode> {
    Rng rng(100000 * e + count);
    auto made = generate_episode(*scenes[e % kFlats]->navmesh, rng);
    if (!made) return made.status();
    made->start_time = rng.uniform(0.0, 600.0);
    return BatchEpisode{e % kFlats, std::move(*made)};
  };
  auto sim = BasicBatchSimulator<CudaBackend>::create(cuda, {scenes.begin(), scenes.end()}, config,
                                                      kEnvironments, episode_of)
                 .value();
  const BatchStep first = sim.reset().value();
  const Judged judged =
      judge(cuda, first, truth_of(sim, scenes[0], config.sensors[0], config.lod.has_value()));

  Rng rng(9);
  std::vector<Action> actions(kEnvironments);
  std::vector<double> calls, world, draw;
  const auto call = [&] {
    for (Action& a : actions) {
      const auto k = rng.below(4);
      a = k == 0 ? Action::turn_left : k == 1 ? Action::turn_right : Action::move_forward;
    }
    const auto begin = Clock::now();
    sim.step(actions).value();
    const std::chrono::duration<double> took = Clock::now() - begin;
    return took.count();
  };
  const bool draws = !people && profile == kFast;
  std::optional<Alone> alone;
  if (draws) alone.emplace(cuda, scenes, side, state.range(1) != 0);
  for (int i = 0; i < 10; ++i) call();  // these allocate the scratch
  for (auto _ : state) {
    calls.push_back(call());
    state.SetIterationTime(calls.back());
    if (draws && calls.size() % 4 == 0) draw.push_back(alone->draw(sim, config.sensors[0]));
  }
  sim.set_rendering(false);
  for (int i = 0; i < 20; ++i) world.push_back(call());
  const double median = gsnav_bench::median(calls);
  state.counters["ms"] = 1e3 * median;
  state.counters["p90_ms"] = 1e3 * gsnav_bench::quantile(calls, 0.9);
  state.counters["steps/s"] = static_cast<double>(kEnvironments) / median;
  state.counters["world_ms"] = 1e3 * gsnav_bench::median(world);
  state.counters["draw_ms"] = 1e-3 * gsnav_bench::median(draw);
  state.counters["psnr"] = judged.psnr;
  state.counters["depth_p99"] = judged.depth_p99;
}
BENCHMARK(step_batch_cuda)
    ->ArgNames({"side", "rgb", "people", "profile"})
    ->ArgsProduct({{64, 128, 256}, {0, 1}, {0, 5}, {kFast, kVisible, kLod}})
    ->ArgsProduct({{64, 128, 256}, {0, 1}, {5}, {kBodies}})
    ->Iterations(100)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
