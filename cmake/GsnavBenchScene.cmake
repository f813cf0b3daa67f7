# SPDX-License-Identifier: Apache-2.0
# make_bench_scene: the generator of the benchmark flat. No target where GSNAV_FLAT_GENERATOR names no file.
if(NOT TARGET make_bench_scene AND EXISTS "${GSNAV_FLAT_GENERATOR}")
  add_executable(make_bench_scene "${GSNAV_FLAT_GENERATOR}")
  set_target_properties(make_bench_scene PROPERTIES CXX_STANDARD 17)
  target_compile_options(make_bench_scene PRIVATE -w -O2)
endif()
