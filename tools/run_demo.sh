#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs missing packages, then builds and runs the example nav_loop. All arguments go to it:
#   tools/run_demo.sh --help
# With --device cuda or cuda:NUMBER, code for the GPU of this machine is compiled too.
#
# GSNAV_NO_APT=1   never call apt-get
# GSNAV_JOBS=N     compile N files at a time (default: see tools/build_jobs.sh)
# GSNAV_PRESET     configure preset (default: demo)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${GSNAV_PRESET:-demo}
build=$root/build/$preset
help=$root/examples/nav_loop/help.txt  # what nav_loop --help prints; a test compares them

# Answer --help and unknown options before anything is built.
device=
previous=
for argument in "$@"; do
  case $argument in
    -h | --help)
      cat "$help"
      exit 0
      ;;
    --device=*) device=${argument#*=} ;;
    --*)
      option=${argument%%=*}
      if ! grep -Eq -- "(^| |,)$option( |,|\$)" "$help"; then
        echo "run_demo.sh: nav_loop has no option $option; tools/run_demo.sh --help lists them" >&2
        exit 2
      fi
      ;;
  esac
  [[ $previous == --device ]] && device=$argument
  previous=$argument
done

cuda=OFF
if [[ $device == cuda* ]]; then
  if ! nvidia-smi -L > /dev/null 2>&1; then
    echo "run_demo.sh: --device $device: nvidia-smi finds no GPU here; leave --device out to run on the CPU" >&2
    exit 2
  fi
  cuda=ON
elif grep -qs '^GSNAV_CUDA:STRING=ON' "$build/CMakeCache.txt"; then
  cuda=ON  # keep the CUDA build of an earlier run
fi

"$root/tools/install_deps.sh" demo >&2
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

# Progress goes to stderr, so that stdout is the example's own.
if [[ -x $build/examples/nav_loop ]]; then
  echo "Building what has changed of nav_loop in $build" >&2
else
  # CPU seconds on a processor of 2020 or later.
  seconds=300
  [[ $cuda == ON ]] && seconds=$((seconds + 200))
  minutes=$(((seconds / jobs + 59) / 60))
  echo "Building nav_loop in $build, $jobs files at a time: about $minutes minutes" >&2
fi
options=("-DGSNAV_CUDA=$cuda" -DGSNAV_AVX512=OFF)
grep -qs avx512bw /proc/cpuinfo && options+=(-DGSNAV_AVX512=ON)
[[ $cuda == ON ]] && options+=(-DCMAKE_CUDA_ARCHITECTURES=native)
cmake -S "$root" --preset "$preset" --log-level=WARNING "${options[@]}" >&2
cmake --build "$build" --target nav_loop -j "$jobs" >&2

program=$build/examples/nav_loop
echo "Running $program $*" >&2
exec "$program" "$@"
