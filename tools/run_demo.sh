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

usage_error() {
  echo "run_demo.sh: $1; tools/run_demo.sh --help lists the options" >&2
  exit 2
}

# Refuses a value that is not of the kind that the help text names for the option.
check_value() {
  local option=$1 value=$2 pattern= kind choices range
  kind=$(sed -nE "s/^  $option ([A-Z]+[^ =]*).*/\1/p" "$help" | head -n 1)
  case $kind in
    INT* | UINT*) pattern='^[+-]?[0-9]+$' ;;
    FLOAT*) pattern='^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?$' ;;
    *:{*)
      choices=${kind#*:\{}
      [[ ,${choices%%\}*}, == *",$value,"* ]] || usage_error "$option $value: nav_loop does not take this value"
      ;;
  esac
  # The range, such as "in [0 - 64]".
  range=$(sed -nE "s/^  $option [A-Z:]+ in \[(\S+ - [^]]+)\].*/\1/p" "$help" | head -n 1)
  if [[ -n $range && $value =~ $pattern ]]; then
    awk -v v="$value" -v low="${range% - *}" -v high="${range#* - }" \
      'BEGIN { exit !(v + 0 >= low + 0 && v + 0 <= high + 0) }' ||
      usage_error "$option $value: nav_loop does not take this value, but those in [$range]"
  fi
  [[ $option == --device ]] && pattern='^(best|cpu|cuda|serial(64)?)(:[0-9]+)?$'
  [[ $value =~ $pattern ]] || usage_error "$option $value: nav_loop does not take this value"
}

# Nothing is built for --help, for --version, and for options and values that nav_loop does not take.
device=
previous=
for argument in "$@"; do
  case $argument in
    -h | --help)
      cat "$help"
      exit 0
      ;;
    --version)
      sed -nE 's/.*GSNAV_VERSION_(MAJOR|MINOR|PATCH) ([0-9]+).*/\2/p' "$root/include/gsnav/version.hpp" |
        paste -sd. | sed 's/^/nav_loop /'
      exit 0
      ;;
    --*)
      option=${argument%%=*}
      grep -Eq -- "(^| |,)$option( |,|\$)" "$help" || usage_error "nav_loop has no option $option"
      if [[ $argument == *=* ]]; then
        check_value "$option" "${argument#*=}"
        [[ $option == --device ]] && device=${argument#*=}
      fi
      ;;
    *) [[ $previous == --* && $previous != *=* ]] && check_value "$previous" "$argument" ;;
  esac
  [[ $previous == --device ]] && device=$argument
  previous=$argument
done
[[ $previous == --* && $previous != *=* ]] && usage_error "$previous needs a value"

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
