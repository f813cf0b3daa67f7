// SPDX-License-Identifier: Apache-2.0
// The floor of a frame on this machine (floor.hpp): the cost of each unit of work by the survey and by
// loops that are measured here, and by both the least time of the workload's frames. bench_render
// divides its times by the floor.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_floor [threads]
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "floor.hpp"
#include "workload.hpp"

using namespace gsnav_bench;

namespace {

void print_costs(int threads) {
  const UnitCosts survey = survey_costs(threads), measured = measured_costs(threads),
                  least = least_costs(threads);
  std::printf("\n%d thread%s            survey   measured      least\n", threads,
              threads == 1 ? " " : "s");
  const auto line = [](const char* name, double a, double b, double used, const char* unit) {
    std::printf("  %-20s %8.4g   %8.4g   %8.4g  %s\n", name, a, b, used, unit);
  };
  line("streaming read", survey.bytes_per_ns, measured.bytes_per_ns, least.bytes_per_ns,
       "GB/s, measured in both");
  line("sort", survey.sort_ns, measured.sort_ns, least.sort_ns, "ns / visible");
  line("bin", survey.bin_ns, measured.bin_ns, least.bin_ns, "ns / visible and pair");
  line("4x4 mask", survey.mask_ns, measured.mask_ns, least.mask_ns, "ns / pair");
  line("fragment, RGB", survey.fragment_ns, measured.fragment_ns, least.fragment_ns, "ns / fragment");
  line("fragment, depth", survey.transmittance_ns, measured.transmittance_ns, least.transmittance_ns,
       "ns / fragment");
  const double cycles = 16 * clock_ghz() * threads;
  line("16 fragments, RGB", survey.fragment_ns * cycles, measured.fragment_ns * cycles,
       least.fragment_ns * cycles, "cycles of a thread");
}

}  // namespace

int main(int argc, char** argv) {
  const int most = argc > 1 ? std::max(1, std::atoi(argv[1])) : 2;
  std::printf("clock %.2f GHz (the survey's machine: 3.55)\n", clock_ghz());
  for (int threads = 1; threads <= most; threads *= 2) print_costs(threads);

  std::printf("\n%zu Gaussians, mean of %zu views, RGB; M: million fragments\n", workload().cloud.size(),
              workload().cameras.size());
  std::printf("%9s %9s %9s %9s %9s %9s | floor, ms: threads, by the survey (least, hard)\n", "size",
              "visible", "pairs", "eval M", "needed M", "blended M");
  const int sizes[][2] = {{256, 256}, {640, 480}, {1920, 1080}};
  for (const auto& size : sizes) {
    FrameWork mean;
    std::map<int, std::array<double, 3>> floors;
    const std::vector<gsnav::Camera> cameras = sized(size[0], size[1]);
    const double n = static_cast<double>(cameras.size());
    for (const gsnav::Camera& camera : cameras) {
      gsnav::RenderConfig config;
      config.outputs = gsnav::kRgb;
      const FrameWork work = count_work(workload().cloud, camera, config);
      mean.visible += work.visible / n;
      mean.pairs += work.pairs / n;
      mean.evaluated += work.evaluated / n;
      mean.needed += work.needed / n;
      mean.blended += work.blended / n;
      for (int threads = 1; threads <= most; threads *= 2) {
        auto& sum = floors[threads];
        sum[0] += floor_ms(work, threads) / n;
        sum[1] += least_floor_ms(work, threads) / n;
        sum[2] += hard_floor_ms(work, threads) / n;
      }
    }
    std::printf("%4dx%-4d %9.0f %9.0f %9.2f %9.2f %9.2f |", size[0], size[1], mean.visible, mean.pairs,
                mean.evaluated * 1e-6, mean.needed * 1e-6, mean.blended * 1e-6);
    for (const auto& [threads, f] : floors)
      std::printf("  %d: %.3f (%.3f, %.3f)", threads, f[0], f[1], f[2]);
    std::printf("\n");
  }
}
