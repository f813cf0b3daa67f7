#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs what is missing, builds and runs the navigation loop example. All arguments go to it:
#   tools/run_demo.sh --help
#
# GSNAV_NO_APT=1   never call apt-get
# GSNAV_JOBS=N     compile N files at a time (default: one per processor, no more than memory carries)
# GSNAV_PRESET     configure preset (default: release)
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${GSNAV_PRESET:-release}
build=$root/build/$preset

"$root/tools/install_deps.sh" demo >&2
jobs=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}

# Progress goes to stderr, so that stdout is the example's own.
echo "Building nav_loop in $build, $jobs files at a time" >&2
cmake -S "$root" --preset "$preset" --log-level=WARNING >&2
cmake --build "$build" --target nav_loop -j "$jobs" >&2

program=$build/examples/nav_loop
[[ -d $program ]] && program=$program/nav_loop
echo "Running $program $*" >&2
exec "$program" "$@"
