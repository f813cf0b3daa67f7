// SPDX-License-Identifier: Apache-2.0
// Whole frames: time, error against float64 by the contract, and memory in one row.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_render
//
// Without the variables: the embedded flat from its four viewpoints. floor_ratio of rows on the processor is
// the time over the least that its frames could take on this machine (floor.hpp).
#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "error.hpp"
#include "floor.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif
#include "gsnav/scene/renderer.hpp"
#include "workload.hpp"

using namespace gsnav;
using gsnav_bench::sized;
using gsnav_bench::workload;

namespace {

/// At most this many views have their float64 reference rendered.
constexpr std::size_t kReferenceViews = 4;

const Frames<double>& reference(int width, int height) {
  static std::map<std::pair<int, int>, Frames<double>> cache;
  auto& entry = cache[{width, height}];
  if (entry.cameras == 0) {
    std::vector<Camera> cameras = sized(width, height);
    if (cameras.size() > kReferenceViews) cameras.resize(kReferenceViews);
    SerialBackend serial;
    Renderer<double, SerialBackend> renderer(serial);
    const std::vector<GaussianSet> sets{workload().cloud.set()};
    entry = renderer.render(sets, cameras).value();
  }
  return entry;
}

/// Work of every view, counted once a size and kind of output: the floor does not depend on the profile.
const std::vector<gsnav_bench::FrameWork>& work_of_views(const RenderConfig& config, int width, int height) {
  static std::map<std::tuple<int, int, bool>, std::vector<gsnav_bench::FrameWork>> cache;
  const auto [entry, added] = cache.try_emplace({width, height, (config.outputs & kRgb) != 0});
  if (added) {
    for (const Camera& camera : sized(width, height)) {
      entry->second.push_back(gsnav_bench::count_work(workload().cloud, camera, config));
    }
  }
  return entry->second;
}

/// `threads`: of the processor; 0 for a row that is not the processor's, which has no floor here.
template <class B>
void render_frames(benchmark::State& state, B& backend, const RenderConfig& config, int width,
                   int height, int threads) {
  const std::vector<Camera> cameras = sized(width, height);
  const GaussianArrays<B> arrays(backend, workload().cloud);
  const std::vector<GaussianSet> sets{arrays.set()};
  Renderer<float, B> renderer(backend, config);
  Frames<float> frames;
  std::size_t next = 0;
  double visible = 0, pairs = 0, count = 0;
  const auto draw = [&](std::size_t c) {
    renderer.render(sets, std::span(&cameras[c % cameras.size()], 1), frames).throw_if_error();
  };
  for (std::size_t c = 0; c < cameras.size(); ++c) draw(c);  // buffers reach their size
  const auto begin = std::chrono::steady_clock::now();
  for (auto _ : state) {
    draw(next++);
    visible += static_cast<double>(frames.stats[0].visible);
    pairs += static_cast<double>(frames.stats[0].tile_intersections);
    ++count;
  }
  const std::chrono::duration<double, std::milli> drawn = std::chrono::steady_clock::now() - begin;
  const Frames<double>& truth = reference(width, height);
  const std::span<const Camera> compared(cameras.data(), truth.cameras);
  const Frames<float> f = renderer.render(sets, compared).value();
  if (!f.rgb.empty()) {
    const auto e = gsnav_bench::error_of(f.rgb, truth.rgb);
    state.counters["rgb_max"] = e.max;
    state.counters["rgb_p99.9"] = e.p999;
    state.counters["rgb_psnr"] = e.psnr;
  }
  if (!f.median_depth.empty()) {
    std::vector<float> depth;
    std::vector<double> depth_truth;
    for (std::size_t i = 0; i < truth.alpha.size(); ++i) {
      if (truth.alpha[i] > 0.9) {
        depth.push_back(f.median_depth[i]);
        depth_truth.push_back(truth.median_depth[i]);
      }
    }
    state.counters["depth_p99_m"] = gsnav_bench::error_of(depth, depth_truth).p99;
  }
  if (threads > 0) {
    const auto& work = work_of_views(config, width, height);
    const gsnav_bench::UnitCosts costs = gsnav_bench::floor_costs(threads);
    double floor = 0;  // of all frames timed
    for (std::size_t i = 0; i < next; ++i) floor += gsnav_bench::floor_ms(work[i % work.size()], costs);
    state.counters["floor_ratio"] = drawn.count() / floor;
  }
  state.counters["visible"] = visible / count;
  state.counters["pairs"] = pairs / count;
  state.counters["scratch_MB"] = static_cast<double>(renderer.scratch_bytes()) / 1e6;
}

void register_all() {
  const std::pair<int, int> sizes[] = {{256, 256}, {640, 480}, {1920, 1080}};
  struct Variant {
    const char* name;
    unsigned outputs;
    Profile profile;
  };
  const Variant variants[] = {{"rgbd/exact", kRgb | kAlpha | kMedianDepth, Profile::exact},
                              {"rgbd/fast", kRgb | kAlpha | kMedianDepth, Profile::fast},
                              {"rgb/exact", kRgb, Profile::exact},
                              {"depth/exact", kMedianDepth, Profile::exact}};
  for (const auto& [width, height] : sizes) {
    for (const Variant& v : variants) {
      RenderConfig config;
      config.outputs = v.outputs;
      config.profile = v.profile;
      const std::string suffix =
          std::string(v.name) + "/" + std::to_string(width) + "x" + std::to_string(height);
      for (const int threads : {1, 2}) {
        benchmark::RegisterBenchmark(
            ("openmp" + std::to_string(threads) + "/" + suffix).c_str(),
            [=, w = width, h = height](benchmark::State& state) {
              OpenMPBackend backend(threads);
              render_frames(state, backend, config, w, h, threads);
            })
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
#if defined(GSNAV_HAS_CUDA)
      if (CudaBackend::device_count() > 0) {
        benchmark::RegisterBenchmark(("cuda/" + suffix).c_str(),
                                     [=, w = width, h = height](benchmark::State& state) {
                                       CudaBackend backend;
                                       render_frames(state, backend, config, w, h, 0);
                                     })
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
#endif
      if (width == 256) {
        benchmark::RegisterBenchmark(("serial/" + suffix).c_str(),
                                     [=, w = width, h = height](benchmark::State& state) {
                                       SerialBackend backend;
                                       render_frames(state, backend, config, w, h, 1);
                                     })
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::printf("%zu Gaussians, %zu views, lanes: %s x%d\n", workload().cloud.size(),
              workload().cameras.size(), lane_kernels().name, lane_kernels().width);
  register_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
