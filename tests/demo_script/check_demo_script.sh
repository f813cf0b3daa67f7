#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# usage: check_demo_script.sh PROGRAM SOURCE_FOLDER
# The help that tools/run_demo.sh prints is that of the program, and what it can answer by itself it answers without
# apt-get, cmake or a compiler.
set -euo pipefail
program=$1 source=$2

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
fail() { echo "FAILED: $*"; failed=1; }

(exec -a nav_loop "$program" --help) > "$work/help.txt"
if ! diff "$source/examples/nav_loop/help.txt" "$work/help.txt"; then
  fail "examples/nav_loop/help.txt is not what nav_loop prints; write it anew:" \
       "(exec -a nav_loop $program --help) > examples/nav_loop/help.txt"
fi

# In place of what installs and builds: programs that leave a trace. nvidia-smi finds no GPU.
mkdir "$work/bin"
for name in apt-get cmake ninja sudo; do
  printf '#!/bin/sh\necho %s >> "%s/called"\nexit 1\n' $name "$work" > "$work/bin/$name"
done
printf '#!/bin/sh\nexit 9\n' > "$work/bin/nvidia-smi"
chmod +x "$work"/bin/*
demo() {
  status=0
  PATH=$work/bin:$PATH "$source/tools/run_demo.sh" "$@" > "$work/out.txt" 2> "$work/err.txt" || status=$?
}

for help in --help -h "--episodes 3 --help"; do
  # shellcheck disable=SC2086
  demo $help
  [[ $status -eq 0 ]] && diff -q "$source/examples/nav_loop/help.txt" "$work/out.txt" || fail "run_demo.sh $help"
done
demo --episode 3
[[ $status -eq 2 ]] && grep -q -- "no option --episode;" "$work/err.txt" || fail "run_demo.sh --episode: status $status"
for value in "--episodes abc" --episodes=1.5 "--hfov 1e2x" --device=bogus "--device cpu:x" "--up w" --storage=none \
  "--avatars 99" --episodes=0 "--hfov 170.5" --density=1e3 "--show -2"; do
  # shellcheck disable=SC2086
  demo $value
  [[ $status -eq 2 ]] && grep -q "does not take this" "$work/err.txt" || fail "run_demo.sh $value: $status"
done
demo --device
[[ $status -eq 2 ]] && grep -q -- "--device needs a value" "$work/err.txt" || fail "run_demo.sh --device: $status"
for value in "--avatars 64" --avatars=+0 "--show -1" "--hfov 1.7e2" --lod-error=.01; do
  # The range is right, and the device is the next thing that is wrong.
  # shellcheck disable=SC2086
  demo $value --device cuda
  [[ $status -eq 2 ]] && grep -q "no GPU" "$work/err.txt" || fail "run_demo.sh $value: $status"
done
demo --version
version=$(exec -a nav_loop "$program" --version)
[[ $status -eq 0 && $(cat "$work/out.txt") == "$version" ]] || fail "run_demo.sh --version"
demo --out=folder --device=cuda:1
[[ $status -eq 2 ]] && grep -q "no GPU" "$work/err.txt" || fail "run_demo.sh --device=cuda:1: status $status"
demo --device cuda
[[ $status -eq 2 ]] && grep -q "no GPU" "$work/err.txt" || fail "run_demo.sh --device cuda: status $status"
[[ -e $work/called ]] && fail "to answer, it called $(sort -u "$work/called" | tr '\n' ' ')"
exit $failed
