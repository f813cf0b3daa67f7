// SPDX-License-Identifier: Apache-2.0
// The floor of a frame on this machine (floor.hpp): what each unit of work costs, measured and by the survey, and
// the least time of the workload's frames. bench_render divides its times by it.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_floor [threads]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "floor.hpp"
#include "floor_loops.hpp"
#include "workload.hpp"

using namespace gsnav_bench;

namespace {

void print_costs(int threads, double clock) {
  const UnitCosts survey = survey_costs(threads), measured = measured_costs(threads);
  std::printf("\n%d thread%s            survey   measured   in the floor\n", threads, threads == 1 ? " " : "s");
  const auto line = [](const char* name, double a, double b, double used, const char* unit) {
    std::printf("  %-20s %8.4g   %8.4g   %8.4g  %s\n", name, a, b, used, unit);
  };
  const UnitCosts used = floor_costs(threads);
  line("streaming read", survey.bytes_per_ns, measured.bytes_per_ns, used.bytes_per_ns, "GB/s");
  line("sort", survey.sort_ns, measured.sort_ns, used.sort_ns, "ns / visible");
  line("bin", survey.bin_ns, measured.bin_ns, used.bin_ns, "ns / visible and pair");
  line("4x4 mask", survey.mask_ns, measured.mask_ns, used.mask_ns, "ns / pair");
  line("fragment, RGB", survey.fragment_ns, measured.fragment_ns, used.fragment_ns, "ns / fragment");
  line("fragment, depth", survey.transmittance_ns, measured.transmittance_ns, used.transmittance_ns,
       "ns / fragment");
  const double cycles = 16 * clock * threads;
  line("16 fragments, RGB", 13.4, measured.fragment_ns * cycles, used.fragment_ns * cycles, "cycles of a thread");
}

}  // namespace

int main(int argc, char** argv) {
  const int most = argc > 1 ? std::max(1, std::atoi(argv[1])) : 2;
  const double clock = measure_clock();
  std::printf("clock %.2f GHz (the survey's machine: 3.55)\n", clock);
  for (int threads = 1; threads <= most; threads *= 2) print_costs(threads, clock);

  std::printf("\n%zu Gaussians, mean of %zu views, RGB\n", workload().cloud.size(), workload().cameras.size());
  std::printf("%9s %9s %9s %9s %9s | floor, ms: threads (hard)\n", "size", "visible", "pairs", "eval M", "blended M");
  const int sizes[][2] = {{256, 256}, {640, 480}, {1920, 1080}};
  for (const auto& size : sizes) {
    FrameWork mean;
    std::vector<double> floors, hard;
    const std::vector<gsnav::Camera> cameras = sized(size[0], size[1]);
    const double n = static_cast<double>(cameras.size());
    for (const gsnav::Camera& camera : cameras) {
      gsnav::RenderConfig config;
      config.outputs = gsnav::kRgb;
      const FrameWork work = count_work(workload().cloud, camera, config);
      mean.visible += work.visible / n;
      mean.pairs += work.pairs / n;
      mean.evaluated += work.evaluated / n;
      mean.blended += work.blended / n;
      std::size_t at = 0;
      for (int threads = 1; threads <= most; threads *= 2, ++at) {
        floors.resize(std::max(floors.size(), at + 1));
        hard.resize(floors.size());
        floors[at] += floor_ms(work, floor_costs(threads)) / n;
        hard[at] += hard_floor_ms(work, floor_costs(threads)) / n;
      }
    }
    std::printf("%4dx%-4d %9.0f %9.0f %9.2f %9.2f |", size[0], size[1], mean.visible, mean.pairs,
                mean.evaluated * 1e-6, mean.blended * 1e-6);
    for (std::size_t i = 0; i < floors.size(); ++i) std::printf("  %d: %.3f (%.3f)", 1 << i, floors[i], hard[i]);
    std::printf("\n");
  }
}
