// SPDX-License-Identifier: Apache-2.0
// One row per kernel, scalar type and backend: its time, and its error against the same kernel in
// float64.
#include "kernel_bench.hpp"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  gsnav_bench::register_frame_kernels();
  gsnav_bench::register_skin_kernels();
  gsnav_bench::register_body_kernels();
  gsnav_bench::register_capsule_kernels();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
