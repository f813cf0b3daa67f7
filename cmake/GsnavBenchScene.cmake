# SPDX-License-Identifier: Apache-2.0
# make_bench_scene: the generator of the benchmark flat, which lies beside the data. No target where it is
# not there.
set(_generator "${GSNAV_DATA_DIR}/../bench_scene/make_bench_scene.cpp")
if(NOT TARGET make_bench_scene AND EXISTS "${_generator}")
  add_executable(make_bench_scene "${_generator}")
  set_target_properties(make_bench_scene PROPERTIES CXX_STANDARD 17)
  target_compile_options(make_bench_scene PRIVATE -w -O2)
endif()
