// SPDX-License-Identifier: Apache-2.0
// Parts of the time of a simulator's frame on a GPU.
#include <benchmark/benchmark.h>

#include <chrono>
#include <memory>
#include <vector>

#include "device_time.hpp"
#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/cuda/pinned.hpp"
#include "gsnav/detail/demo/people.hpp"
#include "gsnav/sim/basic_simulator.hpp"
#include "gsnav/sim/follower.hpp"
#include "samples.hpp"

namespace {

using namespace gsnav;
using Clock = std::chrono::steady_clock;

constexpr double kGaussiansAtOne = 390000;  // Gaussians of the flat at density 1, about
constexpr int kSide = 256;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

/// BasicSimulator::observe() of RGB and depth, 256 x 256, on a follower's path. The time is that of the
/// call.
///
/// Counters, all medians: draw_us is the device's time for drawing the scene from the same cameras
/// without people. copy_us is its time for copying the images to page-locked memory. host_us is the
/// remainder of the call. world_us is the time of an action without images, which the call does not
/// contain. Arguments: thousands of Gaussians, people.
void observe_cuda(benchmark::State& state) {
  if (CudaBackend::device_count() == 0) {
    state.SkipWithError("no GPU");
    return;
  }
  CudaBackend cuda;
  SimulatorConfig config;
  config.task = TaskConfig::avatar_pointnav();
  config.sensors = rgbd_sensors(kSide, kSide);
  const auto scene = std::make_shared<const SimulatorScene>(
      default_simulator_scene(static_cast<std::size_t>(state.range(1)), 1,
                              1e3 * static_cast<double>(state.range(0)) / kGaussiansAtOne, config.task)
          .value());
  const auto episodes = generate_episodes(*scene->navmesh, 16, 1).value();
  auto sim = BasicSimulator<CudaBackend>::create(cuda, scene, config).value();

  CudaBatchRenderer renderer(cuda, sim.config().render);
  std::vector<GaussianArrays<CudaBackend>> arrays;
  std::vector<GaussianSet> sets;
  for (const SceneAsset& a : scene->assets) {
    sets.push_back(arrays.emplace_back(cuda, *a.cloud).set(a.world_from_asset));
  }
  Buffer<float, CudaBackend> there(cuda);
  there.resize_discard(4 * kPixels);
  BatchImages images;
  images.floats.rgb = there.data();
  images.floats.median_depth = there.data() + 3 * kPixels;
  PinnedArray<float> here(4 * kPixels);
  gsnav_bench::DeviceTime device(cuda);

  const GeodesicFollower follower;
  std::size_t episode = 0;
  std::vector<double> wall, draw, copy, world;
  const auto frame = [&](bool counts) {
    if (episode == 0 || sim.done()) sim.reset(episodes[episode++ % episodes.size()]).value();
    const Action action = follower.next(sim.world());
    sim.set_rendering(false);
    const auto start = Clock::now();
    sim.step(action).value();
    const auto begin = Clock::now();
    sim.set_rendering(true);
    sim.observe().value();
    const std::chrono::duration<double> took = Clock::now() - begin;

    const AgentPose& agent = sim.agent();
    const BatchCamera camera{
        sensor_camera(config.sensors[0], agent.position, agent.rotation(), agent.pitch), {}};
    const double drawn =
        device.us([&] { renderer.render(sets, std::span(&camera, 1), images).throw_if_error(); });
    renderer.finish().throw_if_error();
    const double copied = device.us([&] { there.download(here.data(), here.size()); });
    if (!counts) return took.count();
    wall.push_back(1e6 * took.count());
    world.push_back(1e6 * std::chrono::duration<double>(begin - start).count());
    draw.push_back(drawn);
    copy.push_back(copied);
    return took.count();
  };
  for (int i = 0; i < 20; ++i) frame(false);  // these allocate the scratch
  for (auto _ : state) state.SetIterationTime(frame(true));
  const double median = gsnav_bench::median(wall),
               device_us = gsnav_bench::median(draw) + gsnav_bench::median(copy);
  state.counters["wall_us"] = median;
  state.counters["wall_p90_us"] = gsnav_bench::quantile(wall, 0.9);
  state.counters["draw_us"] = gsnav_bench::median(draw);
  state.counters["copy_us"] = gsnav_bench::median(copy);
  state.counters["host_us"] = median - device_us;
  state.counters["world_us"] = gsnav_bench::median(world);
  state.counters["Gaussians"] = static_cast<double>(scene->assets[0].cloud->size());
}
BENCHMARK(observe_cuda)
    ->ArgNames({"thousands", "people"})
    ->Args({300, 0})
    ->Args({1000, 0})
    ->Args({3000, 0})
    ->Args({1000, 10})
    ->Iterations(300)
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
