#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Hashes the images of the tests `images` and `hard_cases` on the serial backend, on OpenMP with each
# instruction set of this machine, and on the emulated CUDA backend.
#
#   tools/image_hashes.sh FILE           builds both tests and writes FILE, one line per image
#   tools/image_hashes.sh FILE BEFORE    writes FILE, and fails if a line differs from the file BEFORE
#
# Run it before and after a change that must keep every bit. A first run takes ten minutes on two cores.
#
# GSNAV_JOBS=N   compile N files at a time (default: see tools/build_jobs.sh)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
case ${1:-} in
  "" | -*)
    sed -n '4,14s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
    exit $([[ ${1:-} == --help || ${1:-} == -h ]] && echo 0 || echo 2)
    ;;
esac
out=$(realpath -m "$1")
before=${2:+$(realpath "$2")}
build=$root/build/image-hashes
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

options=()
command -v ccache > /dev/null && options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG" \
  -DGSNAV_CUDA=EMULATED -DGSNAV_TESTS=ON -DGSNAV_TOOLS=OFF -DGSNAV_EXAMPLES=OFF -DGSNAV_BENCH=OFF \
  -DGSNAV_INSTALL=OFF "${options[@]}" > /dev/null
cmake --build "$build" -j "$jobs" --target test_images test_hard_cases

lines=$(mktemp)
trap 'rm -f "$lines" "$lines".*' EXIT
# GSNAV_ISA only lowers the choice. A processor without AVX-512 draws "avx512" with its widest set.
for isa in baseline avx2 avx512; do
  part=$lines.$isa
  for test in images hard_cases; do
    echo "Drawing: $test, $isa"
    cases=()  # other backends do not depend on the instruction set
    [[ $isa == baseline ]] || cases=(GSNAV_CASES_ON=openmp)
    env "${cases[@]}" GSNAV_ISA=$isa GSNAV_IMAGE_HASHES=$part "$build/tests/$test/test_$test" --no-version --minimal
  done
  # Only OpenMP depends on the instruction set; keep the other lines once.
  grep -F '| openmp' "$part" | sed "s/| openmp/| $isa openmp/" >> "$lines"
  [[ $isa == baseline ]] && grep -vF '| openmp' "$part" >> "$lines"
done
LC_ALL=C sort "$lines" > "$out.new"
mv "$out.new" "$out"
echo "$(wc -l < "$out") images: $out"
if [[ -n $before ]]; then
  if ! diff <(LC_ALL=C sort "$before") "$out"; then
    echo "Images differ from those of $before: the lines above, < before, > now" >&2
    exit 1
  fi
  echo "All are the same as in $before"
fi
