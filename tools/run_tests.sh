#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs missing packages, builds everything and runs all tests. Arguments go to ctest:
#   tools/run_tests.sh [--cuda] [-R render ...]
# The exit status is that of ctest. Code for GPUs is compiled if there is a GPU (for that GPU), or with
# --cuda (without a GPU, only to PTX). ccache is used if it is installed.
#
# GSNAV_NO_APT=1      never call apt-get
# GSNAV_DEPS          set of packages (default: by preset); see tools/install_deps.sh
# GSNAV_PRESET        configure preset (default: tests, which compiles fastest); aarch64 runs tests under qemu
# GSNAV_CUDA          AUTO (if nvcc is found), ON (as --cuda) or OFF
# GSNAV_JOBS=N        compile N files and run N tests at a time (default: see tools/build_jobs.sh)
# GSNAV_WERROR=ON     treat warnings as errors (default: as in the preset)
# GSNAV_DATA_DIR=DIR  folder of real scenes; tests that need them are skipped without it
set -euo pipefail

if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '4,15s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit 0
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${GSNAV_PRESET:-tests}
build=$root/build/$preset

deps=tests
[[ $preset == asan-ubsan ]] && deps=ci
[[ $preset == aarch64 ]] && deps=aarch64
"$root/tools/install_deps.sh" "${GSNAV_DEPS:-$deps}"
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

options=()
[[ -n ${GSNAV_WERROR:-} ]] && options+=("-DGSNAV_WERROR=$GSNAV_WERROR")
[[ -n ${GSNAV_DATA_DIR:-} ]] && options+=("-DGSNAV_DATA_DIR=$GSNAV_DATA_DIR")
if [[ $preset != asan-ubsan && $preset != aarch64 && $preset != cuda ]]; then
  cuda=${GSNAV_CUDA:-}
  if [[ ${1:-} == --cuda ]]; then
    cuda=ON
    shift
  fi
  if nvidia-smi -L > /dev/null 2>&1; then
    options+=("-DGSNAV_CUDA=${cuda:-AUTO}" -DCMAKE_CUDA_ARCHITECTURES=native)
  else
    # Nothing can run it: PTX, not optimised, is compiled in a quarter of the time.
    options+=("-DGSNAV_CUDA=${cuda:-OFF}" -DCMAKE_CUDA_ARCHITECTURES=75-virtual
              "-DCMAKE_CUDA_FLAGS_RELEASE=-O1 -DNDEBUG -Xcicc -O0")
  fi
fi
if command -v ccache > /dev/null; then
  options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi

echo "Configuring the preset $preset in $build"
cmake -S "$root" --preset "$preset" "${options[@]}"
echo "Building, $jobs at a time"
cmake --build "$build" -j "$jobs"
# Tests write many small files. In memory, no test waits for the disk.
if [[ -z ${TMPDIR:-} && -w /dev/shm ]] && ! grep -q ' /dev/shm .*noexec' /proc/mounts &&
  [[ $(df --output=avail -k /dev/shm | tail -n 1) -gt 2000000 ]]; then
  export TMPDIR=/dev/shm
fi
echo "Testing"
cd "$root"
exec ctest --preset "$preset" -j "$jobs" --no-label-summary "$@"
