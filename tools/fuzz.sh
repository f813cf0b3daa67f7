#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Fuzzes every reader under ASan and UBSan (clang with libFuzzer), in the build of the preset asan-ubsan.
#
# usage: tools/fuzz.sh [SECONDS [READER...]]
#   SECONDS  time per reader (default: 20)
#   READER   ply, spz, ... (default: all readers)
#
# GSNAV_FUZZ_OUT   folder for corpora (kept between runs), crashes and logs (default: build/fuzz)
# GSNAV_JOBS       number of parallel compilations, and of readers that run at a time
set -euo pipefail

if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '4,11s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit 0
fi
[[ ${1:-20} =~ ^[0-9]+$ ]] || { echo "fuzz.sh: $1: seconds per reader are a whole number; see --help" >&2; exit 2; }
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/asan-ubsan
out=${GSNAV_FUZZ_OUT:-$root/build/fuzz}
seconds=${1:-20}
shift $(($# > 0 ? 1 : 0))
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

options=()
if command -v ccache > /dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
(cd "$root" && cmake --preset asan-ubsan "${options[@]}" > /dev/null)
cmake --build "$build" -j "$jobs" --target fuzz_readers fuzz_seeds
fuzzer=$build/tests/fuzz/fuzz_readers
"$build/tests/fuzz/fuzz_seeds" "$out/seeds"
# Corpora of earlier runs, smallest files first. They were grown from the seeds.
mkdir -p "$out/corpus" "$out/crashes"
tar --skip-old-files -xJf "$root/tests/fuzz/corpora.tar.xz" -C "$out/corpus" ||
  echo "tests/fuzz/corpora.tar.xz was not unpacked (is xz there?): from the seeds alone"

readers=("$@")
if [[ ${#readers[@]} -eq 0 ]]; then
  mapfile -t readers < <(ls "$out/seeds")
fi

fuzz() {
  local reader=$1 corpus=$out/corpus/$1 log=$out/$1.log runs peak
  mkdir -p "$corpus"
  if ! GSNAV_FUZZ_READER=$reader "$fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=3000 \
    -max_len=20000 -print_final_stats=1 -artifact_prefix="$out/crashes/$reader-" \
    "$corpus" "$out/seeds/$reader" > "$log" 2>&1; then
    echo "$reader: FAILED; the input is in $out/crashes, the report in $log"
    grep -m 3 -E "ERROR|runtime error|fuzz:|SUMMARY" "$log" || tail -n 5 "$log"
    return 1
  fi
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  peak=$(sed -n 's/^stat::peak_rss_mb: *//p' "$log")
  echo "$reader: $runs executions, $(find "$corpus" -type f | wc -l) inputs in the corpus, peak $peak MB"
}

failed=0
running=0
for reader in "${readers[@]}"; do
  if [[ $running -eq $jobs ]]; then
    wait -n || failed=1
    running=$((running - 1))
  fi
  fuzz "$reader" &
  running=$((running + 1))
done
for ((; running > 0; running--)); do wait -n || failed=1; done
exit $failed
