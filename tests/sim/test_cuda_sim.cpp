// SPDX-License-Identifier: Apache-2.0
// Simulators on the GPU against those on the processor: the same world, and images within the contract's
// bound.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "mesh_box.hpp"
#include "ops/no_gpu.hpp"
#include "sim_scene.hpp"
#include "wandering.hpp"
#if defined(SIM_TEST_DLPACK)
#include "gsnav/interop/dlpack.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// How images of the two differ. The contract (CPU against CUDA): 2e-5 but for pixels where
/// transmittance passes within 1e-5 of where blending stops (2e-4, one in a thousand); a median depth
/// 1e-5 m but where alpha is within 1e-3 of a half.
struct Difference {
  std::size_t values = 0, other_bits = 0, over = 0, far_over = 0;
  double worst = 0;

  void add(SensorKind kind, std::span<const float> a, std::span<const float> b) {
    REQUIRE(a.size() == b.size());
    const double bound = kind == SensorKind::depth ? 1e-5 : 2e-5;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double d = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
      other_bits += a[i] == b[i] ? 0 : 1;
      over += d <= bound ? 0 : 1;
      far_over += d <= 10 * bound ? 0 : 1;
      worst = std::max(worst, d);
    }
    values += a.size();
  }
  void check(SensorKind kind) const {
    MESSAGE(values << " values, " << other_bits << " of other bits, " << over
                   << " over the bound, largest difference " << worst);
    CHECK(static_cast<double>(over) <= 1e-3 * static_cast<double>(values));
    // A depth whose pixel is at a half jumps to the next surface, a label to the next set.
    if (kind == SensorKind::rgb || kind == SensorKind::alpha) CHECK(far_over == 0);
  }
};

std::vector<float> fetched(CudaBackend& cuda, const BatchObservation& o) {
  std::vector<float> host(o.environments * static_cast<std::size_t>(o.height * o.width * o.channels));
  const float* from = o.on_backend;
#if defined(SIM_TEST_DLPACK)
  // As a learner gets them.
  DLManagedTensor* const t = interop::to_dlpack(
      o.on_backend, {static_cast<std::int64_t>(o.environments), o.height, o.width, o.channels},
      interop::dlpack_device(cuda), nullptr);
  CHECK(t->dl_tensor.device.device_type == kDLCUDA);
  CHECK(t->dl_tensor.device.device_id == cuda.device());
  from = interop::from_dlpack<const float>(t->dl_tensor, interop::dlpack_device(cuda)).value().data;
  t->deleter(t);
#endif
  cuda.copy(host.data(), from, host.size() * sizeof(float), CopyKind::device_to_host);
  REQUIRE(cuda.synchronize().ok());
  return host;
}

}  // namespace

TEST_CASE("cuda: a simulator among people sees what the OpenMP one sees") {
  if (no_gpu("cuda simulator")) return;
  SimulatorConfig config;
  config.sensors = is_emulated() ? rgbd_sensors(60, 80) : rgbd_sensors(120, 160);
  for (const auto& [uuid, kind] :
       {std::pair{"alpha", SensorKind::alpha}, {"who", SensorKind::semantic}}) {
    config.sensors.push_back(config.sensors[0]);
    config.sensors.back().uuid = uuid;
    config.sensors.back().kind = kind;
  }
  config.sensors.push_back(config.sensors[0]);
  config.sensors.back().uuid = "around";
  config.sensors.back().model = SensorModel::equirectangular;
  CudaBackend cuda;
  OpenMPBackend openmp;
  auto on_gpu = make_simulator(cuda, peopled_scene(4000), config).value();
  auto on_cpu = make_simulator(openmp, peopled_scene(4000), config).value();
  std::vector<Difference> differences(config.sensors.size());
  const auto compare = [&](const Observations& a, const Observations& b) {
    CHECK(a.moved == b.moved);
    CHECK(a.reward == b.reward);
    CHECK(a.avatar_clearance == b.avatar_clearance);
    for (std::size_t i = 0; i < differences.size(); ++i) {
      differences[i].add(a.images[i].kind, a.images[i].data, b.images[i].data);
    }
  };
  compare(on_gpu.reset(to_kitchen()).value(), on_cpu.reset(to_kitchen()).value());
  Rng rng(4);
  for (int i = 0; i < (is_emulated() ? 3 : 30); ++i) {
    const Action action = wandering_action(rng);
    compare(on_gpu.step(action).value(), on_cpu.step(action).value());
  }
  for (std::size_t i = 0; i < differences.size(); ++i) {
    CAPTURE(config.sensors[i].uuid);
    differences[i].check(config.sensors[i].kind);
  }
}

TEST_CASE("cuda: meshes, their normals, and batches with them") {
  if (no_gpu("cuda meshes in a simulator")) return;
  SimulatorScene furnished = peopled_scene(4000);
  furnished.meshes.push_back(turned_box(0.3));
  BatchConfig config;
  config.sensors = rgbd_sensors(64, 96);
  config.sensors.push_back(config.sensors[0]);
  config.sensors[2].uuid = "normal";
  config.sensors[2].kind = SensorKind::normal;
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(furnished),
      std::make_shared<const SimulatorScene>(flat_scene())};
  const auto facing = [](std::size_t environment, std::size_t) -> Result<BatchEpisode> {
    return BatchEpisode{environment % 3 == 2 ? 1u : 0u, to_kitchen()};
  };
  CudaBackend cuda;
  OpenMPBackend openmp;
  auto on_gpu = make_batch_simulator(cuda, scenes, config, 5, facing).value();
  auto on_cpu = make_batch_simulator(openmp, scenes, config, 5, facing).value();
  const auto got = on_gpu.reset().value(), want = on_cpu.reset().value();
  for (std::size_t i = 0; i < 2; ++i) {
    CAPTURE(config.sensors[i].uuid);
    Difference d;
    d.add(config.sensors[i].kind, got.images[i].data, want.images[i].data);
    d.check(config.sensors[i].kind);
  }
  std::size_t normals = 0, other = 0;
  for (std::size_t i = 0; i < want.images[2].data.size(); ++i) {
    normals += want.images[2].data[i] != 0 ? 1 : 0;
    other += std::abs(got.images[2].data[i] - want.images[2].data[i]) < 1e-6f ? 0 : 1;
  }
  CHECK(normals > 1000);
  CHECK(other <= normals / 100);  // where the median depth is the mesh's on one of the two only
}

TEST_CASE("cuda: levels of detail, and what is seen from where") {
  if (no_gpu("cuda levels of detail in a simulator")) return;
  SimulatorScene detailed = peopled_scene(4000);
  CudaBackend cuda;
  OpenMPBackend openmp;
  detailed.assets[0].lod =
      std::make_shared<const LodTree>(build_lod(openmp, *detailed.assets[0].cloud).value());
  BatchConfig config;
  config.sensors = rgbd_sensors(64, 96);
  bool levels = false, visible = false;
  SUBCASE("levels of detail") { levels = true; }
  SUBCASE("visible sets") { visible = true; }
  SUBCASE("both") { levels = visible = true; }
  if (levels) {
    config.lod = LodChoice{};
    give_body_levels(detailed);
  }
  const auto there = [](std::size_t environment, std::size_t count) -> Result<BatchEpisode> {
    BatchEpisode e = wandering(environment, count).value();
    e.scene = 0;
    return e;
  };
  if (visible) {
    VisibleSettings settings;
    settings.face = 96;
    settings.near_plane = config.sensors[0].near_plane;
    settings.near_sigma = config.sensors[0].near_sigma;
    std::vector<Vec3d> eyes;
    for (std::size_t e = 0; e < 2; ++e)
      eyes.push_back(there(e, 0).value().episode.start_position + Vec3d{0, 1.5, 0});  // not the third's
    detailed.assets[0].visible = std::make_shared<const VisibleSets>(
        build_visible_sets(openmp, *detailed.assets[0].cloud, eyes, settings).value());
    config.visible_sets = true;
  }
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(detailed)};
  auto on_gpu = make_batch_simulator(cuda, scenes, config, 3, there).value();
  auto on_cpu = make_batch_simulator(openmp, scenes, config, 3, there).value();
  const auto got = on_gpu.reset().value(), want = on_cpu.reset().value();
  // Levels of detail are of the profile fast, which has another exponential there: its budget, not a
  // rounding's.
  const std::span<const float> rgb = got.images[0].data, expected = want.images[0].data;
  double squares = 0, largest = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double d = std::abs(static_cast<double>(rgb[i]) - static_cast<double>(expected[i]));
    squares += d * d;
    largest = std::max(largest, d);
  }
  const double psnr = -10 * std::log10(std::max(squares / static_cast<double>(expected.size()), 1e-30));
  MESSAGE("PSNR " << psnr << " dB, largest difference " << largest);
  CHECK(psnr > 65);
  CHECK(largest <= 6.0 / 255);
  Difference depth;
  depth.add(SensorKind::depth, got.images[1].data, want.images[1].data);
  depth.check(SensorKind::depth);
}

TEST_CASE("cuda: a batch sees what the OpenMP one sees, in host memory and on the GPU") {
  if (no_gpu("cuda batch simulator")) return;
  const std::vector<std::shared_ptr<const SimulatorScene>> scenes{
      std::make_shared<const SimulatorScene>(peopled_scene(4000)),
      std::make_shared<const SimulatorScene>(flat_scene())};
  BatchConfig config;
  config.sensors = is_emulated() ? rgbd_sensors(32, 48) : rgbd_sensors(64, 96);
  config.sensors[1].far_plane = 5.0;
  const int steps = is_emulated() ? 2 : 30;
  config.task.max_steps = is_emulated() ? 1 : 12;
  config.auto_reset = AutoReset::same_step;
  const std::size_t environments = is_emulated() ? 6 : 12;
  CudaBackend cuda, other;
  OpenMPBackend openmp;
  auto on_cpu = make_batch_simulator(openmp, scenes, config, environments, wandering).value();
  config.pose_slots = 3;  // several calls a step
  auto to_host = make_batch_simulator(cuda, scenes, config, environments, wandering).value();
  config.pose_slots = 64;  // one
  config.images = ImageMemory::backend;
  auto on_gpu = make_batch_simulator(other, scenes, config, environments, wandering).value();
  std::vector<Difference> differences(2);
  std::size_t wrong = 0, finals = 0, told = 0;
  BatchStep early;
  const WhileDrawing meanwhile = [&](const BatchStep& step) -> Status {
    early = step;
    ++told;
    return {};
  };
  const auto compare = [&](const Result<BatchStep>& a, const Result<BatchStep>& b,
                           const Result<BatchStep>& c) {
    const BatchStep host = a.value(), gpu = b.value(), cpu = c.value();
    const auto images = [&](auto x, auto y, auto z) {
      REQUIRE(x.size() == z.size());
      for (std::size_t i = 0; i < x.size(); ++i) {
        differences[i].add(x[i].kind, x[i].data, z[i].data);
        const std::vector<float> there = fetched(other, y[i]);
        REQUIRE(there.size() == x[i].data.size());
        wrong += std::memcmp(there.data(), x[i].data.data(), x[i].data.size_bytes()) == 0 ? 0 : 1;
      }
    };
    images(host.images, gpu.images, cpu.images);
    images(host.final_images, gpu.final_images, cpu.final_images);
    finals += host.finished.size();
    CHECK(early.images.data() == gpu.images.data());
    CHECK(early.images[0].on_backend == gpu.images[0].on_backend);
    for (std::size_t e = 0; e < environments; ++e) {
      wrong += early.rewards[e] == cpu.rewards[e] ? 0 : 1;
      wrong += host.rewards[e] == cpu.rewards[e] && gpu.rewards[e] == cpu.rewards[e] ? 0 : 1;
    }
  };
  compare(to_host.reset(), on_gpu.reset({}, meanwhile), on_cpu.reset());
  Rng rng(6);
  for (int i = 0; i < steps; ++i) {
    std::vector<Action> actions;
    for (std::size_t e = 0; e < environments; ++e) actions.push_back(wandering_action(rng));
    compare(to_host.step(actions), on_gpu.step(actions, meanwhile), on_cpu.step(actions));
  }
  std::vector<std::uint8_t> some{1, 0, 0, 1, 1, 0, 1, 0, 0, 0, 0, 1};
  some.resize(environments);
  compare(to_host.reset(some), on_gpu.reset(some, meanwhile), on_cpu.reset(some));
  CHECK(told == static_cast<std::size_t>(steps + 2));
  CHECK(wrong == 0);
  CHECK(finals >= 2 * environments);
  differences[0].check(SensorKind::rgb);
  differences[1].check(SensorKind::depth);
}
