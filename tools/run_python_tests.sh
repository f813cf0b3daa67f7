#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs missing packages, makes a virtual environment, builds and installs the Python package there, and runs
# its tests. Arguments go to pytest:
#   tools/run_python_tests.sh [-k render ...]
# The exit status is that of pytest. ccache is used if it is installed.
#
# PYTHON=python3.12   interpreter of the virtual environment (default: python3), 3.10 or later
# GSNAV_TEST_WITH=... more packages to install and test with, such as "ray jax torch stable-baselines3"
# GSNAV_VENV=DIR      folder of the virtual environment (default: build/venv)
# GSNAV_NO_APT=1      never call apt-get
# GSNAV_JOBS=N        compile N files at a time; tools/build_jobs.sh has the default
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '4,14s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit 0
fi
python=${PYTHON:-python3}
venv=${GSNAV_VENV:-$root/build/venv}

"$root/tools/install_deps.sh" demo
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2> /dev/null; then
  echo "Python 3.10 or later is needed, and $python is not: set PYTHON to an interpreter." >&2
  exit 1
fi
if [[ ! -x $venv/bin/pip ]] && ! "$python" -m venv "$venv"; then
  echo "$python cannot make a virtual environment. On Debian: apt-get install python3-venv python3-dev" >&2
  exit 1
fi
if ! "$python" -c 'import os, sysconfig; os.stat(sysconfig.get_path("include") + "/Python.h")' 2> /dev/null; then
  echo "The headers of $python are missing. On Debian: apt-get install python3-dev" >&2
  exit 1
fi

export CMAKE_BUILD_PARALLEL_LEVEL=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}
if command -v ccache > /dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
echo "Installing what the build and the tests need in $venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check "scikit-build-core>=0.11" "nanobind>=2.8" \
  "numpy>=1.26" "gymnasium>=1.1" "matplotlib>=3.8" "mypy>=1.11" "pytest>=8" \
  ${GSNAV_TEST_WITH:-}
echo "Building the package, $CMAKE_BUILD_PARALLEL_LEVEL files at a time"
build=$root/build/python
# The build folder is kept, so that only changed files are compiled.
"$venv/bin/pip" install --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall \
  --config-settings=build-dir="$build" --config-settings=cmake.define.GSNAV_TOOLS=ON "$root"
# Programs of C++ whose images the tests compare with.
cmake --build "$build" --target gsnav-render --target gsnav_python_reference -j "$CMAKE_BUILD_PARALLEL_LEVEL"
export GSNAV_TOOLS_DIR=$build/gsnav/tools GSNAV_PYTHON_REFERENCE=$build/gsnav_python_reference
echo "Testing"
cd "$root"
exec "$venv/bin/python" -m pytest "$@"
