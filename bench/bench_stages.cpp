// SPDX-License-Identifier: Apache-2.0
// Stages of a frame: median milliseconds of each stage over all views with its share, on one thread and
// on two, and the speedup of two. There are rows for each combination of outputs, which show what
// leaving out an output saves.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_stages [WIDTHxHEIGHT ...]
//
// Without the variables, the scene is the embedded flat from its four viewpoints. The default sizes are
// 256x256, 640x480 and 1920x1080. `whole` is the time of a frame without the stage clocks; such frames
// alternate with frames that have them.
#include <array>
#include <chrono>
#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "floor_loops.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "samples.hpp"
#include "stage_times.hpp"
#include "workload.hpp"

using namespace gsnav;
using namespace gsnav_bench;

namespace {

struct Variant {
  const char* name;
  unsigned outputs;
  Quality quality;
  bool base_color;  ///< of a scene of SH degree 0
};

constexpr Variant kVariants[] = {
    {"rgb exact", kRgb, Quality::exact(), false},
    {"rgb fast", kRgb, Quality::fast(), false},
    {"rgb fast, SH 0", kRgb, Quality::fast(), true},
    {"rgb+alpha+depth", kRgb | kAlpha | kMedianDepth, Quality::fast(), false},
    {"depth", kMedianDepth, Quality::fast(), false},
    {"alpha", kAlpha, Quality::fast(), false},
};

constexpr int kRepeats = 3;

/// Medians of the stages and of the whole frame.
struct Measured {
  StageTimes stages{};
  double whole = 0;
};

Measured measure(const Variant& v, const std::vector<Camera>& cameras, int threads) {
  RenderConfig config;
  config.outputs = v.outputs;
  config.quality = v.quality;
  const GaussianSet set = (v.base_color ? base_color_cloud() : workload().cloud).set();
  OpenMPBackend plain_backend(threads);
  TimedBackend<OpenMPBackend> timed_backend(threads);
  BasicRenderer<float, OpenMPBackend> plain(plain_backend, config);
  BasicRenderer<float, TimedBackend<OpenMPBackend>> timed(timed_backend, config);
  Frames<float> frames;
  std::array<std::vector<double>, kStages> stages;
  std::vector<double> whole;
  for (int round = 0; round <= kRepeats; ++round) {  // the first round only warms up
    for (const Camera& camera : cameras) {
      const std::span sets(&set, 1);
      const std::span view(&camera, 1);
      timed_backend.begin();
      timed.render(sets, view, frames).throw_if_error();
      const StageTimes t = timed_backend.end();
      const auto begin = std::chrono::steady_clock::now();
      plain.render(sets, view, frames).throw_if_error();
      const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - begin;
      if (round == 0) continue;
      for (std::size_t s = 0; s < kStages; ++s) stages[s].push_back(t[s]);
      whole.push_back(ms.count());
    }
  }
  Measured out;
  for (std::size_t s = 0; s < kStages; ++s) out.stages[s] = median(std::move(stages[s]));
  out.whole = median(std::move(whole));
  return out;
}

void print_row(const char* name, const char* threads, const Measured& m, bool shares) {
  std::printf("%-16s %7s |", name, threads);
  const double sum = sum_of(m.stages);
  for (const double t : m.stages) {
    if (shares) {
      std::printf(" %8.3f %3.0f%%", t, 100 * t / sum);
    } else {
      std::printf(" %7.2fx     ", t);
    }
  }
  if (shares) {
    std::printf(" | %8.3f %8.3f\n", sum, m.whole);
  } else {
    std::printf(" |          %7.2fx\n", m.whole);
  }
}

void run(int width, int height) {
  const std::vector<Camera> cameras = sized(width, height);
  std::printf("\n%dx%d, ms\n%-16s %7s |", width, height, "", "threads");
  for (const char* name : kStageNames) std::printf(" %8s     ", name);
  std::printf(" | %8s %8s\n", "sum", "whole");
  for (const Variant& v : kVariants) {
    const Measured one = measure(v, cameras, 1), two = measure(v, cameras, 2);
    Measured gain;
    for (std::size_t s = 0; s < kStages; ++s) gain.stages[s] = one.stages[s] / two.stages[s];
    gain.whole = one.whole / two.whole;
    print_row(v.name, "1", one, true);
    print_row("", "2", two, true);
    print_row("", "1 -> 2", gain, false);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::pair<int, int>> sizes;
  for (int i = 1; i < argc; ++i) {
    int width = 0, height = 0;
    char rest = 0;
    if (std::sscanf(argv[i], "%dx%d%c", &width, &height, &rest) != 2 || width < 1 || height < 1) {
      std::fprintf(stderr, "bench_stages: %s: a size is WIDTHxHEIGHT, for instance 640x480\n", argv[i]);
      return 2;
    }
    sizes.emplace_back(width, height);
  }
  if (sizes.empty()) sizes = {{256, 256}, {640, 480}, {1920, 1080}};
  std::printf("%zu Gaussians of SH degree %d, %zu views, lanes: %s x%d\n", workload().cloud.size(),
              workload().cloud.sh_degree, workload().cameras.size(), lane_kernels().name,
              lane_kernels().width);
  const double one = measure_bandwidth(1), two = measure_bandwidth(2);
  std::printf("streaming read: %.1f GB/s on one thread, %.1f on two (%.2fx): what projection can gain\n",
              one, two, two / one);
  for (const auto& [width, height] : sizes) run(width, height);
}
