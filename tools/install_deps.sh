#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs the missing Debian or Ubuntu packages for a job.
#
# usage: tools/install_deps.sh demo|python|tests|ci|aarch64
#   demo     build and run the navigation loop
#   python   ... and headers and virtual environments of Debian's python3
#   tests    demo, and the tests, benchmarks and packaging checks
#   ci       tests, and clang with its OpenMP, sanitizers, fuzzer and clang-format, and Doxygen
#   aarch64  build the renderer for 64-bit ARM and run its tests under qemu (preset aarch64)
#
# These are optional and not installed: libopenmpi-dev (nav_eval_mpi), ffmpeg (gsnav-replay --video),
# chromium (test of the page of gsnav-viewer), libfcl-dev (comparison in bench_kernels).
#
# GSNAV_NO_APT=1   never call apt-get; print the missing packages and go on
set -euo pipefail

job=${1:-demo}
usage() { sed -n '4,15s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; }
case $job in
  demo | python | tests | ci | aarch64) ;;
  --help | -h) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac
packages=(g++ cmake ninja-build libpng-dev libjpeg-dev libwebp-dev libzstd-dev zlib1g-dev nlohmann-json3-dev
          librecast-dev libcli11-dev)
if [[ $job == aarch64 ]]; then
  packages=(g++ g++-aarch64-linux-gnu qemu-user cmake ninja-build doctest-dev python3)
fi
if [[ $job == python ]]; then
  packages+=(python3-dev python3-venv)
fi
if [[ $job == tests || $job == ci ]]; then
  packages+=(doctest-dev libbenchmark-dev libeigen3-dev libglm-dev libdlpack-dev libembree-dev pkg-config python3)
fi
if [[ $job == ci ]]; then
  packages+=(clang clang-format doxygen libomp-dev libclang-rt-dev llvm xz-utils ccache libegl-dev libopengl-dev
             qemu-user)
fi

if ! command -v apt-get > /dev/null || ! command -v dpkg-query > /dev/null; then
  echo "No apt-get here. Needed are a C++20 compiler, CMake 3.25, Ninja and what Debian calls:"
  echo "  ${packages[*]}"
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  state=$(dpkg-query -W -f '${Status}' "$package" 2> /dev/null || true)
  [[ $state == "install ok installed" ]] || missing+=("$package")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi
if [[ ${GSNAV_NO_APT:-0} == 1 ]]; then
  echo "Not installed, as GSNAV_NO_APT=1: ${missing[*]}"
  exit 0
fi

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  if ! command -v sudo > /dev/null; then
    echo "These packages are missing, and there is neither root nor sudo to install them. As root, run:" >&2
    echo "  apt-get update && apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 "$@"; }
log=$(mktemp)
trap 'rm -f "$log"' EXIT
echo "Installing ${missing[*]}"
# An update may fail while the packages can still be installed.
apt update > "$log" 2>&1 || echo "apt-get update failed; trying with the lists that are there"
if ! apt install -y --no-install-recommends "${missing[@]}" >> "$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "apt-get could not install: ${missing[*]}" >&2
  echo "Check the network and /etc/apt/sources.list, or install them yourself and run this again." >&2
  exit 1
fi
