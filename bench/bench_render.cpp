// SPDX-License-Identifier: Apache-2.0
// Whole frames. Each row has the time, the error against float64 by the contract, and the memory.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_render
//
// Without the variables, the scene is the embedded flat from its four viewpoints. GSNAV_BENCH_REFERENCES
// names a folder that caches float64 images. GSNAV_BENCH_REPEATS draws every view that many times, for
// medians of a fixed number of frames. GSNAV_BENCH_TIMES_ONLY leaves out error and floor.
//
// median_ms is the median over views of each view's median. floor_ratio is the median over views of a
// frame's time divided by its least possible time on this machine by the survey's constants;
// floor_ratio_best divides by the time from the smallest constants (floor.hpp).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "floor.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif
#include "gsnav/detail/eval/depth_error.hpp"
#include "gsnav/eval/image_error.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "reference.hpp"
#include "samples.hpp"
#include "workload.hpp"

using namespace gsnav;
using gsnav_bench::median;
using gsnav_bench::sized;
using gsnav_bench::workload;

namespace {

struct Variant {
  const char* name;
  unsigned outputs;
  Quality quality;
  bool base_color = false;  ///< of a scene of SH degree 0
  bool axes = false;  ///< with precomputed axes in place of quaternions and scales (processors only)

  const GaussianCloud& cloud() const {
    return base_color ? gsnav_bench::base_color_cloud() : workload().cloud;
  }
  RenderConfig config() const {
    RenderConfig c;
    c.outputs = outputs;
    c.quality = quality;
    return c;
  }
};

constexpr Variant kVariants[] = {{"rgbd/exact", kRgb | kAlpha | kMedianDepth, Quality::exact()},
                                 {"rgbd/fast", kRgb | kAlpha | kMedianDepth, Quality::fast()},
                                 {"rgb/exact", kRgb, Quality::exact()},
                                 {"rgb/fast", kRgb, Quality::fast()},
                                 {"rgb_sh0/fast", kRgb, Quality::fast(), true},
                                 {"rgb_axes/fast", kRgb, Quality::fast(), false, true},
                                 {"depth/exact", kMedianDepth, Quality::exact()},
                                 {"depth/fast", kMedianDepth, Quality::fast()},
                                 {"alpha/fast", kAlpha, Quality::fast()}};

/// Axes of the workload's Gaussians, which a static scene could keep in place of quaternions and scales.
const std::vector<float>* axes_of_workload() {
  static std::vector<float> axes[9];
  const GaussianCloud& cloud = workload().cloud;
  if (axes[0].empty()) {
    for (std::vector<float>& plane : axes) plane.resize(cloud.size());
    const ShapeRows view = cloud.view().shape;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Mat3<float> rotation = rotation_matrix(quat_of(view, i));
      const Vec3<float> scales = scales_of(view, i);
      for (std::size_t r = 0; r < 3; ++r) {
        axes[3 * r][i] = rotation.row[r].x * scales.x;
        axes[3 * r + 1][i] = rotation.row[r].y * scales.y;
        axes[3 * r + 2][i] = rotation.row[r].z * scales.z;
      }
    }
  }
  return axes;
}

double to_ms(std::chrono::steady_clock::duration d) {
  return std::chrono::duration<double, std::milli>(d).count();
}

/// Work of every view, counted once per size and kind of output, since the floor does not depend on the
/// profile.
const std::vector<gsnav_bench::FrameWork>& work_of_views(const Variant& v, int width, int height) {
  static std::map<std::tuple<int, int, bool, bool>, std::vector<gsnav_bench::FrameWork>> cache;
  const auto [entry, added] = cache.try_emplace({width, height, (v.outputs & kRgb) != 0, v.base_color});
  if (added) {
    const std::vector<Camera> cameras = sized(width, height);
    entry->second.resize(cameras.size());
    auto& work = entry->second;
    OpenMPBackend all;
    all.parallel_for(cameras.size(), [&](std::size_t c) {
      work[c] = gsnav_bench::count_work(v.cloud(), cameras[c], v.config());
    });
  }
  return entry->second;
}

/// Adds the errors of the images, the worst of the judged views. Pixels that rounding alone decides
/// count only in the PSNR.
template <class B>
void judge(benchmark::State& state, BasicRenderer<float, B>& renderer, std::span<const GaussianSet> sets,
           const Variant& v, const std::vector<Camera>& cameras) {
  const std::vector<Camera> judged = gsnav_bench::judged_views(cameras);
  const auto& truth = gsnav_bench::references(v.cloud(), cameras);
  const auto worst = [&](const char* name, double value, bool least) {
    const auto [entry, added] = state.counters.try_emplace(name, value);
    if (!added && (least ? value < entry->second.value : value > entry->second.value))
      entry->second.value = value;
  };
  for (std::size_t c = 0; c < judged.size(); ++c) {
    const Frames<float> f = renderer.render(sets, std::span(&judged[c], 1)).value();
    const gsnav_report::Reference& r = truth[c];
    if (!f.rgb.empty()) {
      const eval::ImageError e = eval::image_error(r.rgb, f.rgb, 3, r.undecided).value();
      worst("rgb_max", e.max, false);
      worst("rgb_p99.9", e.p999, false);
      worst("rgb_psnr", e.psnr, true);
    }
    if (!f.alpha.empty()) {
      worst("alpha_max", eval::image_error(r.alpha, f.alpha, 1, r.undecided).value().max, false);
    }
    if (!f.median_depth.empty()) {
      const auto e = eval::depth_error(r.depth, f.median_depth, r.alpha, r.undecided_depth).value();
      worst("depth_p99_m", e.p99, false);
    }
  }
}

/// Times frames. `threads`: threads of the processor; 0 for a GPU, whose rows have no floor.
template <class B>
void render_frames(benchmark::State& state, B& backend, const Variant& v, int width, int height,
                   int threads) {
  const std::vector<Camera> cameras = sized(width, height);
  const GaussianArrays<B> arrays(backend, v.cloud());
  std::vector<GaussianSet> sets{arrays.set()};
  if (v.axes) {
    for (std::size_t k = 0; k < 9; ++k)
      sets[0].gaussians.shape.axes.set(k, view_of(axes_of_workload()[k]));
  }
  BasicRenderer<float, B> renderer(backend, v.config());
  Frames<float> frames;
  double visible = 0, pairs = 0, count = 0;
  const auto draw = [&](std::size_t c) {
    renderer.render(sets, std::span(&cameras[c], 1), frames).throw_if_error();
  };
  for (std::size_t c = 0; c < cameras.size(); c += 4) draw(c);  // all buffers reach their size
  std::vector<std::vector<double>> ms(cameras.size());
  std::size_t next = 0;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    draw(next);
    ms[next].push_back(to_ms(std::chrono::steady_clock::now() - begin));
    visible += static_cast<double>(frames.stats[0].visible);
    pairs += static_cast<double>(frames.stats[0].tile_intersections);
    ++count;
    next = (next + 1) % cameras.size();
  }
  const bool times_only = std::getenv("GSNAV_BENCH_TIMES_ONLY") != nullptr;
  if (!times_only) judge(state, renderer, sets, v, cameras);
  std::vector<double> view_ms, ratios, best_ratios, units;
  for (std::size_t c = 0; c < ms.size(); ++c) {
    if (ms[c].empty()) continue;  // fewer iterations than views
    view_ms.push_back(median(ms[c]));
    if (threads == 0 || times_only) continue;
    const gsnav_bench::FrameWork& work = work_of_views(v, width, height)[c];
    ratios.push_back(view_ms.back() / gsnav_bench::floor_ms(work, threads));
    best_ratios.push_back(view_ms.back() / gsnav_bench::least_floor_ms(work, threads));
    units.push_back(work.visible + work.evaluated);
  }
  state.counters["median_ms"] = median(view_ms);
  if (!ratios.empty()) {
    state.counters["floor_ratio"] = median(ratios);
    state.counters["floor_ratio_best"] = median(best_ratios);
    state.counters["visible+fragments"] = median(units);
  }
  state.counters["visible"] = visible / count;
  state.counters["pairs"] = pairs / count;
  state.counters["scratch_MB"] = static_cast<double>(renderer.scratch_bytes()) / 1e6;
  state.counters["scene_MB"] = static_cast<double>(v.cloud().bytes()) / 1e6;
}

/// 64 cameras in one call against 64 calls of one camera, in turns. `gain`: frames per second of the
/// batch divided by those of the single calls. `bits_differ`: number of image values that differ
/// between the two.
template <class B>
void render_batch(benchmark::State& state, B& backend, const Variant& v, int width, int height) {
  constexpr std::size_t kBatch = 64;
  const std::vector<Camera> views = sized(width, height);
  std::vector<Camera> cameras;
  for (std::size_t c = 0; c < kBatch; ++c) cameras.push_back(views[c % views.size()]);
  const GaussianArrays<B> arrays(backend, v.cloud());
  const std::vector<GaussianSet> sets{arrays.set()};
  BasicRenderer<float, B> batch_renderer(backend, v.config()), single_renderer(backend, v.config());
  Frames<float> batch, single;
  std::vector<double> batch_ms, single_ms;
  double differ = 0;
  const auto round = [&](bool compare) {
    double calls = 0;
    for (std::size_t c = 0; c < kBatch; ++c) {
      const auto begin = std::chrono::steady_clock::now();
      single_renderer.render(sets, std::span(&cameras[c], 1), single).throw_if_error();
      calls += to_ms(std::chrono::steady_clock::now() - begin);
      if (!compare) continue;
      const auto differences = [&](const std::vector<float>& one, const std::vector<float>& all) {
        for (std::size_t i = 0; i < one.size(); ++i) differ += one[i] != all[c * one.size() + i] ? 1 : 0;
      };
      differences(single.rgb, batch.rgb);
      differences(single.alpha, batch.alpha);
      differences(single.median_depth, batch.median_depth);
    }
    const auto begin = std::chrono::steady_clock::now();
    batch_renderer.render(sets, cameras, batch).throw_if_error();
    return std::pair(calls, to_ms(std::chrono::steady_clock::now() - begin));
  };
  round(false);
  for (auto _ : state) {
    const auto [calls, whole] = round(false);
    state.SetIterationTime(whole * 1e-3);
    single_ms.push_back(calls);
    batch_ms.push_back(whole);
  }
  round(true);
  state.counters["frames_per_s"] = 1e3 * kBatch / median(batch_ms);
  state.counters["single_frames_per_s"] = 1e3 * kBatch / median(single_ms);
  state.counters["gain"] = median(single_ms) / median(batch_ms);
  state.counters["bits_differ"] = differ;
  state.counters["scratch_MB"] = static_cast<double>(batch_renderer.scratch_bytes()) / 1e6;
}

template <class Run>
benchmark::internal::Benchmark* add_row(const std::string& name, const Run& run) {
  return benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

void register_all() {
  const std::pair<int, int> sizes[] = {{256, 256}, {640, 480}, {1920, 1080}};
  const char* repeats_text = std::getenv("GSNAV_BENCH_REPEATS");
  const int repeats = repeats_text != nullptr ? std::atoi(repeats_text) : 0;
  const auto timed = [repeats](benchmark::internal::Benchmark* row) {
    row->UseRealTime();
    if (repeats > 0)
      row->Iterations(repeats * static_cast<benchmark::IterationCount>(workload().cameras.size()));
  };
  for (const auto& [width, height] : sizes) {
    const int w = width, h = height;
    for (const Variant& v : kVariants) {
      const std::string suffix = std::string(v.name) + "/" + std::to_string(w) + "x" + std::to_string(h);
      for (const int threads : {1, 2}) {
        timed(add_row("openmp" + std::to_string(threads) + "/" + suffix, [=](benchmark::State& state) {
          OpenMPBackend backend(threads);
          render_frames(state, backend, v, w, h, threads);
        }));
        if (w == 256 && v.quality == Quality::fast() && !v.base_color && !v.axes) {
          add_row("openmp" + std::to_string(threads) + "/batch64/" + suffix,
                  [=](benchmark::State& state) {
                    OpenMPBackend backend(threads);
                    render_batch(state, backend, v, w, h);
                  })
              ->UseManualTime();
        }
      }
#if defined(GSNAV_HAS_CUDA)
      if (CudaBackend::device_count() > 0 && !v.axes) {
        timed(add_row("cuda/" + suffix, [=](benchmark::State& state) {
          CudaBackend backend;
          render_frames(state, backend, v, w, h, 0);
        }));
      }
#endif
      if (w == 256) {
        timed(add_row("serial/" + suffix, [=](benchmark::State& state) {
          SerialBackend backend;
          render_frames(state, backend, v, w, h, 1);
        }));
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  // On stderr, because stdout may be JSON.
  std::fprintf(stderr, "%zu Gaussians, %zu views, lanes: %s x%d\n", workload().cloud.size(),
               workload().cameras.size(), lane_kernels().name, lane_kernels().width);
  register_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
