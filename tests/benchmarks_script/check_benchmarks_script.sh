#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
set -euo pipefail
script=$1/tools/benchmarks.sh
at=$(mktemp -d)
trap 'rm -rf "$at"' EXIT
fail() { echo "check_benchmarks_script.sh: $*" >&2; exit 1; }

mkdir -p "$at/b/tools" "$at/b/bench"
# gsnav-scene flat ... --out FILE; bench_render is not called.
cat > "$at/b/tools/gsnav-scene" << 'SCENE'
#!/usr/bin/env bash
while [[ $1 != --out ]]; do shift; done
touch "$2"
SCENE
printf '#!/usr/bin/env bash\nexit 1\n' > "$at/b/bench/bench_render"
chmod +x "$at/b/tools/gsnav-scene" "$at/b/bench/bench_render"
measure() { "$script" --build "$at/b" --out "$at/out" --no-cpu --quick "$@"; }

"$script" --help | grep -q -- --no-cpu || fail "--help does not name --no-cpu"
said=$(measure 2>&1) && fail "it measured nothing, and said that it succeeded"
[[ $said == *"bench_batch is not built"* ]] || fail "without bench_batch it says: $said"
said=$(measure --no-gpu 2>&1) && fail "--no-cpu --no-gpu succeeds"
[[ $said == *"--no-gpu was given"* ]] || fail "with --no-gpu it says: $said"

# No GPU: bench_batch --device fails.
printf '#!/usr/bin/env bash\necho "bench_batch: no GPU" >&2\nexit 1\n' > "$at/b/bench/bench_batch"
chmod +x "$at/b/bench/bench_batch"
said=$(measure 2>&1) && fail "without a GPU, --no-cpu succeeds"
[[ $said == *"no GPU that CUDA can use"* ]] || fail "without a GPU it says: $said"

# An older program: it knows no --device.
printf '#!/usr/bin/env bash\nexit 2\n' > "$at/b/bench/bench_batch"
said=$(measure 2>&1) && fail "with an older bench_batch, it succeeds"
[[ $said == *"does not know --device"* ]] || fail "with an older bench_batch it says: $said"

# A GPU: one row per profile and number of cameras, for three kinds of images.
cat > "$at/b/bench/bench_batch" << 'BATCH'
#!/usr/bin/env bash
[[ $1 != --device ]] || { echo "Some GPU"; exit 0; }
echo "Some GPU: 100000 Gaussians"
for profile in fast exact; do echo "$profile 64 0.5 0.6 2000 1e-3 1e-4 80.0 79.5 1e-6 12 34.5 56"; done
BATCH
measure > /dev/null 2>&1 || fail "it does not measure on a GPU"
grep -q '^## Some GPU$' "$at/out/benchmarks.md" || fail "the page does not name the GPU"
[[ $(grep -c '^| flat 100K | 256x256 |' "$at/out/benchmarks.md") == 6 ]] || fail "there are not six rows"
grep -q '| RGB-D | 64 | fast | 0.5 | 0.6 | 79.5 | 1e-3 | 1e-6 | 34.5 |' "$at/out/benchmarks.md" || fail "a row is wrong"
