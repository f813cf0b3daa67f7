#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Measures the rows of gsnav in docs/benchmarks.md and README.md, on scenes that it makes itself: frame times on a
# processor and, with CUDA and a GPU, on that. Each time has its error against float64 beside it.
#
#   tools/benchmarks.sh                builds the programs in build/benchmarks, measures, writes
#                                      OUT/benchmarks.md
#   tools/benchmarks.sh --build DIR    takes the programs of a build folder made with GSNAV_BENCH=ON
#   tools/benchmarks.sh --quick        one scene of 100,000 Gaussians at 256x256, one turn
#
#   --out DIR          folder for scenes, references and results (default: out/benchmarks)
#   --gaussians LIST   sizes of the flat (default: 100000,300000,1000000)
#   --sizes LIST       image sizes (default: 256x256,640x480,1920x1080; on a GPU also 64x64 and 128x128)
#   --cameras LIST     cameras per call on a GPU (default: 1,64,256)
#   --no-gpu           processor alone
#   --no-cpu           GPU alone
#
# The first run computes float64 references and keeps them in the folder; later runs take less time.
# Times are medians over 64 views. They mean something only while no other program runs.
#
# GSNAV_JOBS=N   compile N files at a time (default: see tools/build_jobs.sh)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build="" out=$root/out/benchmarks gaussians=100000,300000,1000000 sizes=256x256,640x480,1920x1080 cameras=1,64,256
rounds=2 cpu=1 gpu=1 small="64x64 128x128"  # of a GPU, with the last of --cameras
usage() { sed -n '4,22s/^# \{0,1\}//p' "$root/tools/benchmarks.sh"; }
stop() { echo "benchmarks.sh: $*" >&2; exit 2; }
while [[ $# -gt 0 ]]; do
  case $1 in
    --build | --out | --gaussians | --sizes | --cameras)
      [[ $# -ge 2 ]] || stop "$1 needs a value"
      printf -v "${1#--}" '%s' "$2"
      shift
      ;;
    --quick) gaussians=100000 sizes=256x256 small="" rounds=1 ;;
    --no-gpu) gpu=0 ;;
    --no-cpu) cpu=0 ;;
    --help | -h) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
  shift
done
[[ $gaussians =~ ^[0-9]+(,[0-9]+)*$ ]] || stop "--gaussians $gaussians: use 100000,300000"
[[ $cameras =~ ^[0-9]+(,[0-9]+)*$ ]] || stop "--cameras $cameras: use 1,64,256"
[[ $sizes =~ ^[0-9]+x[0-9]+(,[0-9]+x[0-9]+)*$ ]] || stop "--sizes $sizes: use 256x256,640x480"

if [[ -z $build ]]; then
  build=$root/build/benchmarks
  mkdir -p "$build"
  cmake -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DGSNAV_BENCH=ON -DGSNAV_TESTS=OFF \
    -DCMAKE_UNITY_BUILD=ON -DGSNAV_EXAMPLES=OFF -DGSNAV_INSTALL=OFF > "$build/configure.log" 2>&1 ||
    { cat "$build/configure.log" >&2; stop "not configured; tools/install_deps.sh tests installs what is missing"; }
  targets=(gsnav-scene bench_render)
  targets_there=$(cmake --build "$build" --target help)
  [[ $targets_there != *bench_batch:* ]] || targets+=(bench_batch)
  cmake --build "$build" -j "${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}" --target "${targets[@]}"
fi
scene=$build/tools/gsnav-scene render=$build/bench/bench_render batch=$build/bench/bench_batch
for program in "$scene" "$render"; do
  [[ -x $program ]] || stop "there is no $program; configure with -DGSNAV_BENCH=ON and build it"
done
if [[ $gpu == 0 ]]; then
  no_gpu="--no-gpu was given"
elif [[ ! -x $batch ]]; then
  gpu=0 no_gpu="bench_batch is not built (-DGSNAV_CUDA=ON)"
else
  device=$("$batch" --device 2>&1) && status=0 || status=$?
  ((status <= 1)) || stop "$batch does not know --device, build it again: $device"
  ((status == 0)) || gpu=0 no_gpu="this machine has no GPU that CUDA can use"
fi
[[ $cpu == 1 || $gpu == 1 ]] || stop "--no-cpu leaves nothing to measure: $no_gpu"

mkdir -p "$out"
out=$(cd "$out" && pwd)
of() { # 300000 -> 300K
  if (($1 % 1000000 == 0)); then echo "$(($1 / 1000000))M"; else echo "$(($1 / 1000))K"; fi
}
scenes=()
for count in ${gaussians//,/ }; do
  if [[ ! -f $out/flat_$count.ply ]]; then
    "$scene" flat --gaussians "$count" --out "$out/flat_$count.ply" --cameras "$out/cameras.json" \
      --views 64 --hfov 90 --width 256 --height 256
  fi
  scenes+=(--scene "flat $(of "$count")=$out/flat_$count.ply:$out/cameras.json")
done

if [[ $cpu == 1 ]]; then
  "$root/tools/cpu_table.py" --build "$build" --sizes "$sizes" --rounds "$rounds" --cache "$out/cpu" \
    --out "$out/cpu.md" "${scenes[@]}"
fi

# A row of bench_batch: profile batch ms p90 frames/s rgb_max p99.9 psnr least depth_p99 pairs scratch host_us
rows_of_gpu() {
  awk -v scene="$1" -v size="$2" -v images="$3" '
    $1 == "fast" || $1 == "exact" {
      for (i = 3; i <= NF; ++i) if ($i ~ /nan/) $i = "–"  # the error of an image that is not drawn
      printf "| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n",
        scene, size, images, $2, $1, $3, $4, $9, $6, $10, $12
    }'
}
if [[ $gpu == 1 ]]; then
  {
    echo "| scene | size | images | cameras per call | profile | ms per frame | 90th percentile | PSNR, dB |" \
         "largest error | depth p99, m | scratch, MB |"
    echo "|---|---|---|---:|---|---:|---:|---:|---:|---:|---:|"
    for count in ${gaussians//,/ }; do
      for size in $small ${sizes//,/ }; do
        counts=1
        [[ $size != 256x256 ]] || counts=$cameras
        [[ " $small " != *" $size "* ]] || counts=${cameras##*,}
        for images in RGB-D RGB depth; do
          option=""
          [[ $images == RGB-D ]] || option=--${images,,}
          echo "GPU: $(of "$count"), $size, $images" >&2
          # shellcheck disable=SC2086
          GSNAV_BENCH_SCENE=$out/flat_$count.ply GSNAV_BENCH_CAMERAS=$out/cameras.json \
            "$batch" --size "$size" $option ${counts//,/ } | tee "$out/gpu_${count}_${size}_$images.txt" |
            rows_of_gpu "flat $(of "$count")" "$size" "$images"
        done
      done
    done
  } > "$out/gpu.md"
fi

{
  commit=$(git -C "$root" describe --always --dirty 2> /dev/null || echo "not a repository")
  echo "# Benchmarks of $(date +%Y-%m-%d), commit $commit"
  if [[ $cpu == 1 ]]; then
    printf '\n## Processor\n\n'
    cat "$out/cpu.md"
  fi
  if [[ $gpu == 1 ]]; then
    printf '\n## %s\n\n' "$device"
    printf 'RGB-D is RGB, alpha and median depth; depth is median depth alone. '
    printf 'PSNR is the worst of four evenly spread views (0, 16, 32 and 48 of 64).\n\n'
    cat "$out/gpu.md"
  else
    printf '\nNo rows of a GPU: %s.\n' "$no_gpu"
  fi
} > "$out/benchmarks.md"
echo "$out/benchmarks.md"
