#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Fuzzes every reader under ASan and UBSan (clang with libFuzzer), one after the other.
#
# usage: tools/fuzz.sh [SECONDS [READER...]]
#   SECONDS  for each reader, 20 if not given
#   READER   ply, spz, ... (all if none is given)
#
# GSNAV_FUZZ_BUILD   build folder, build/fuzz if not set; corpora stay in its corpus/ and grow
# GSNAV_JOBS         parallel compilations
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=${GSNAV_FUZZ_BUILD:-$root/build/fuzz}
seconds=${1:-20}
shift $(($# > 0 ? 1 : 0))

options=()
if command -v ccache > /dev/null; then options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
cmake -S "$root" -B "$build" -G Ninja "${options[@]}" -DCMAKE_CXX_COMPILER="${GSNAV_FUZZ_CXX:-clang++}" -DCMAKE_BUILD_TYPE=None \
  -DGSNAV_FUZZ=ON -DGSNAV_CUDA=OFF -DGSNAV_OPENMP=OFF -DGSNAV_SIM=OFF -DGSNAV_EVAL=OFF -DGSNAV_TOOLS=OFF \
  -DGSNAV_EXAMPLES=OFF -DGSNAV_INSTALL=OFF > /dev/null
cmake --build "$build" -j "${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}" --target fuzz_readers fuzz_seeds
fuzzer=$build/tests/fuzz/fuzz_readers
"$build/tests/fuzz/fuzz_seeds" "$build/seeds"
# What was found of earlier runs, smallest first; all of it was grown from the seeds.
mkdir -p "$build/corpus"
tar --skip-old-files -xJf "$root/tests/fuzz/corpora.tar.xz" -C "$build/corpus" ||
  echo "tests/fuzz/corpora.tar.xz was not unpacked (is xz there?): from the seeds alone"

readers=("$@")
if [[ ${#readers[@]} -eq 0 ]]; then
  mapfile -t readers < <(ls "$build/seeds")
fi
failed=0
for reader in "${readers[@]}"; do
  corpus=$build/corpus/$reader
  mkdir -p "$corpus" "$build/crashes"
  log=$build/$reader.log
  if ! GSNAV_FUZZ_READER=$reader "$fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=3000 \
    -max_len=20000 -print_final_stats=1 -artifact_prefix="$build/crashes/$reader-" \
    "$corpus" "$build/seeds/$reader" > "$log" 2>&1; then
    failed=1
    echo "$reader: FAILED; the input is in $build/crashes, the report in $log"
    grep -m 3 -E "ERROR|runtime error|fuzz:|SUMMARY" "$log" || tail -n 5 "$log"
    continue
  fi
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  peak=$(sed -n 's/^stat::peak_rss_mb: *//p' "$log")
  echo "$reader: $runs executions, $(find "$corpus" -type f | wc -l) inputs in the corpus, peak $peak MB"
done
exit $failed
