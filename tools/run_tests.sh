#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds everything and runs all tests. Arguments go to ctest:
#   tools/run_tests.sh [--cuda] [-R render ...]
# The last lines are ctest's, its exit status is the script's. The GPU's code is compiled where there is a GPU, for that
# GPU, and where --cuda asks for it; then, without a GPU, for the oldest one.
#
# GSNAV_NO_APT=1      never call apt-get
# GSNAV_DEPS          set of packages: demo, tests, ci (default: what the preset needs); see tools/install_deps.sh
# GSNAV_PRESET        configure preset (default: tests, which compiles fastest)
# GSNAV_CUDA          AUTO: where nvcc is found; ON: as --cuda; OFF: not even where there is a GPU
# GSNAV_JOBS=N        compile N files and run N tests at a time (default: see tools/build_jobs.sh)
# GSNAV_WERROR=ON     warnings are errors (default: as the preset says)
# GSNAV_DATA_DIR=DIR  folder of real scenes; tests that want them skip where it is absent
# ccache is used where it is there.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${GSNAV_PRESET:-tests}
build=$root/build/$preset

deps=tests
[[ $preset == asan-ubsan ]] && deps=ci
"$root/tools/install_deps.sh" "${GSNAV_DEPS:-$deps}"
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

options=()
[[ -n ${GSNAV_WERROR:-} ]] && options+=("-DGSNAV_WERROR=$GSNAV_WERROR")
[[ -n ${GSNAV_DATA_DIR:-} ]] && options+=("-DGSNAV_DATA_DIR=$GSNAV_DATA_DIR")
if [[ $preset != asan-ubsan && $preset != cuda ]]; then
  cuda=${GSNAV_CUDA:-}
  if [[ ${1:-} == --cuda ]]; then
    cuda=ON
    shift
  fi
  if nvidia-smi -L > /dev/null 2>&1; then
    options+=("-DGSNAV_CUDA=${cuda:-AUTO}" -DCMAKE_CUDA_ARCHITECTURES=native)
  else
    options+=("-DGSNAV_CUDA=${cuda:-OFF}" -DCMAKE_CUDA_ARCHITECTURES=75-real)
  fi
fi
if command -v ccache > /dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

echo "Configuring the preset $preset in $build"
cmake -S "$root" --preset "$preset" "${options[@]}"
echo "Building, $jobs at a time"
cmake --build "$build" -j "$jobs"
echo "Testing"
cd "$root"
exec ctest --preset "$preset" -j "$jobs" --no-label-summary "$@"
