// SPDX-License-Identifier: Apache-2.0
// The two performance tables of the Habitat-GS paper, for this simulator. It runs a PointNav loop with
// 256 x 256 RGB and depth. Columns are frames per second, milliseconds and memory, for each backend. One
// table is by the number of Gaussians, the other by the number of people in a scene of 2M Gaussians.
// Scenes and people are the project's own: the embedded flat at the density that the row needs.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/detail/sim/scene_library.hpp"
#include "gsnav/detail/sim/start_times.hpp"
#include "gsnav/sim/basic_batch.hpp"
#include "gsnav/sim/follower.hpp"
#include "report/runner_system.hpp"
#if defined(GSNAV_HAS_CUDA)
#include <cuda_runtime_api.h>

#include "gsnav/backends/cuda.hpp"
#endif

using namespace gsnav;
using Clock = std::chrono::steady_clock;

namespace {

constexpr double kGaussiansAtOne = 390000;  // Gaussians of the flat at density 1, about
constexpr int kSide = 256, kWarmUp = 10;

struct Options {
  int steps = 300, threads = 0;
  std::size_t environments = 1;
  double most = 7;  // millions of Gaussians
  std::vector<std::string> backends{"openmp"};
};

/// A scene and its episodes, the same for every backend.
struct Place {
  std::shared_ptr<const SimulatorScene> scene;
  std::vector<PointNavEpisode> episodes;
  SimulatorConfig config;
};

struct Row {
  double ms = 0, rendering = 0;  // ms per frame; rendering: its share of that time
};

/// Peak of the bytes that GPU backends have held; 0 without a GPU. `restart` begins a new peak.
double peak_gpu_bytes([[maybe_unused]] bool restart) {
#if defined(GSNAV_HAS_CUDA)
  cudaMemPool_t pool = nullptr;
  if (cudaDeviceGetDefaultMemPool(&pool, 0) != cudaSuccess) return 0.0;
  std::uint64_t bytes = 0;
  cudaMemPoolGetAttribute(pool, cudaMemPoolAttrUsedMemHigh, &bytes);
  std::uint64_t zero = 0;
  if (restart) cudaMemPoolSetAttribute(pool, cudaMemPoolAttrUsedMemHigh, &zero);
  return static_cast<double>(bytes);
#else
  return 0.0;
#endif
}

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

Place make_place(double millions, std::size_t people) {
  Place p;
  p.config.task = TaskConfig::avatar_pointnav();
  p.config.sensors = rgbd_sensors(kSide, kSide);
  p.scene = std::make_shared<const SimulatorScene>(
      default_simulator_scene(people, 1, millions * 1e6 / kGaussiansAtOne, p.config.task).value());
  p.episodes = generate_episodes(*p.scene->navmesh, 64, 1).value();
  draw_start_times(p.episodes, *p.scene, p.config.task, 1).throw_if_error();
  return p;
}

/// One simulator plays episodes with the follower. The first actions allocate scratch and are not
/// counted.
template <class B>
Row play_one(B& backend, const Options& o, const Place& place) {
  auto sim = BasicSimulator<B>::create(backend, place.scene, place.config).value();
  const GeodesicFollower follower;
  std::size_t episode = 0;
  double total = 0, beside = 0;
  for (int i = -kWarmUp; i < o.steps; ++i) {
    if (i == -kWarmUp || sim.done())
      sim.reset(place.episodes[episode++ % place.episodes.size()]).value();
    const Action action = follower.next(sim.world());
    const auto begin = Clock::now();
    sim.set_rendering(false);
    sim.step(action).value();
    const double world = seconds_since(begin);
    sim.set_rendering(true);
    sim.observe().value();
    if (i < 0) continue;
    total += seconds_since(begin);
    beside += world;
  }
  return {1e3 * total / o.steps, 1.0 - beside / total};
}

/// Many simulators in one batch, whose images stay in the backend's memory. Every second step draws
/// nothing: its time is that of all work but rendering.
template <class B>
Row play_many(B& backend, const Options& o, const Place& place) {
  BatchConfig config;
  static_cast<SimulatorConfig&>(config) = place.config;
  config.images = ImageMemory::backend;
  config.pose_slots = o.environments;
  const auto episode_of = [&](std::size_t e, std::size_t count) -> Result<BatchEpisode> {
    return BatchEpisode{0, place.episodes[(7 * e + count) % place.episodes.size()]};
  };
  auto sim =
      BasicBatchSimulator<B>::create(backend, {place.scene}, config, o.environments, episode_of).value();
  sim.reset().value();
  const GeodesicFollower follower;
  std::vector<Action> actions(o.environments);
  double total = 0, beside = 0;
  for (int i = -kWarmUp; i < 2 * o.steps; ++i) {
    for (std::size_t e = 0; e < o.environments; ++e) {
      actions[e] = sim.world(e).done() ? Action::stop : follower.next(sim.world(e));
    }
    const bool drawing = i % 2 == 0;
    sim.set_rendering(drawing);
    const auto begin = Clock::now();
    sim.step(actions).value();
    if (i >= 0) (drawing ? total : beside) += seconds_since(begin);
  }
  return {1e3 * total / (o.steps * static_cast<double>(o.environments)), 1.0 - beside / total};
}

void head(const char* what) {
  std::printf("\n%s\n%8s %12s %8s %12s %10s %11s %10s %10s %10s\n", what, "backend", "Gaussians",
              "people", "frames/s", "ms", "rendering", "scene, MB", "peak, MB", "GPU, MB");
}

template <class B>
void row(B&& backend, const char* name, const Options& o, const Place& place) {
  gsnav_report::reset_peak_memory();
  peak_gpu_bytes(true);
  const Row r = o.environments > 1 ? play_many<B>(backend, o, place) : play_one<B>(backend, o, place);
  std::printf("%8s %12zu %8zu %12.1f %10.3f %10.1f%% %10.0f %10.0f %10.0f\n", name,
              place.scene->assets[0].cloud->size(), place.scene->avatars.size(), 1e3 / r.ms, r.ms,
              100 * r.rendering, static_cast<double>(scene_bytes(*place.scene)) * 1e-6,
              static_cast<double>(gsnav_report::peak_memory()) * 1e-6, peak_gpu_bytes(false) * 1e-6);
  std::fflush(stdout);
}

void rows(const Options& o, double millions, std::size_t people) {
  const Place place = make_place(millions, people);
  for (const std::string& name : o.backends) {
    if (name == "openmp") row(OpenMPBackend(o.threads), "openmp", o, place);
#if defined(GSNAV_HAS_CUDA)
    if (name == "cuda") row(CudaBackend(), "cuda", o, place);
#endif
  }
}

}  // namespace

int main(int argc, char** argv) try {
  Options o;
#if defined(GSNAV_HAS_CUDA)
  if (CudaBackend::device_count() > 0) o.backends.push_back("cuda");
#endif
  CLI::App app{
      "A PointNav loop with 256 x 256 RGB and depth: speed and memory by Gaussians and by people."};
  app.add_option("--steps", o.steps, "actions a row")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--threads", o.threads, "threads of openmp, 0: all")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--most", o.most, "no row with more millions of Gaussians")
      ->capture_default_str()
      ->check(CLI::Range(0.02, 7.0));
  app.add_option("--environments", o.environments,
                 "above 1: a batch with this number of environments; ms and frames/s are per frame")
      ->capture_default_str()
      ->check(CLI::Range(1, 4096));
  app.add_option("--backend", o.backends, "openmp, cuda (where there is one), or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"openmp", "cuda"}));
  CLI11_PARSE(app, argc, argv);
#if defined(GSNAV_HAS_CUDA)
  const int gpus = CudaBackend::device_count();
#else
  const int gpus = 0;
#endif
  if (gpus == 0 && std::find(o.backends.begin(), o.backends.end(), "cuda") != o.backends.end()) {
    std::fprintf(stderr, "bench_paper_table: --backend cuda: no GPU, or a build without CUDA\n");
    return 1;
  }
  std::printf("%s, %zu threads; %d actions per row, %zu at once\n", gsnav_report::machine_name().c_str(),
              OpenMPBackend(o.threads).concurrency(), o.steps, o.environments);
  head("by Gaussians");
  for (const double millions : {0.3, 0.5, 1.0, 3.0, 5.0, 7.0}) {
    if (millions <= o.most) rows(o, millions, 0);
  }
  head("by people among 2M (fewer where --most says so)");
  for (const std::size_t people : {0u, 1u, 2u, 5u, 10u}) rows(o, std::min(2.0, o.most), people);
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "bench_paper_table: %s\n", e.what());
  return 1;
}
