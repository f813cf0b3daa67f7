#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs missing packages, makes a virtual environment, builds and installs the Python package there, and runs
# its tests, in up to eight processes. Arguments go to pytest; -n 0 makes it one process, as --pdb needs:
#   tools/run_python_tests.sh [-k render ...]
# The exit status is not 0 if types are wrong or a test fails. ccache is used if it is installed.
#
# PYTHON=python3.12   interpreter of the virtual environment (default: python3), 3.10 or later
# GSNAV_WERROR=ON     treat warnings of the library as errors
# GSNAV_FLAGS=...     compiler flags instead of "-O3 -DNDEBUG", such as "-O1 -DNDEBUG" for a faster build
# GSNAV_ASAN=1        use AddressSanitizer, in folders of its own. 10^5 random calls, without images of C++ tools:
#                     GSNAV_ASAN=1 GSNAV_RANDOM_CALLS=100000 tools/run_python_tests.sh -k "random or order"
# GSNAV_TEST_WITH=... more packages to install and test with, such as "ray jax torch stable-baselines3"
# GSNAV_VENV=DIR      folder of the virtual environment (default: build/venv)
# GSNAV_NO_APT=1      never call apt-get
# GSNAV_JOBS=N        compile N files and run N files of tests (at most 8) together; tools/build_jobs.sh has the default
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [[ ${1:-} == --help || ${1:-} == -h ]]; then
  sed -n '4,18s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
  exit 0
fi
python=${PYTHON:-python3}
# As CMake names the compiler by itself. ccache keeps objects by this name.
export CC=${CC:-cc} CXX=${CXX:-c++}
venv=$root/build/venv build=$root/build/python flags=${GSNAV_FLAGS:--O3 -DNDEBUG} stubs=ON timeout=600 run=()
if [[ ${GSNAV_ASAN:-0} == 1 ]]; then
  venv+=-asan build+=-asan flags="-O1 -g1 -fno-omit-frame-pointer -fsanitize=address" stubs=OFF timeout=0
  # Python is not built for the sanitizer, so its library must be loaded first. Python leaks at exit.
  run=(env LD_PRELOAD="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libstdc++.so)"
       ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 PYTHONMALLOC=malloc)
fi
venv=$(realpath -m "${GSNAV_VENV:-$venv}")

# True if the interpreter can make virtual environments and compile modules.
complete() {
  "$python" -c 'import ensurepip, os, sysconfig, venv
os.stat(sysconfig.get_path("include") + "/Python.h")' 2> /dev/null
}
"$root/tools/install_deps.sh" demo
complete || "$root/tools/install_deps.sh" python
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2> /dev/null; then
  echo "Python 3.10 or later is needed, and $python is not: set PYTHON to an interpreter." >&2
  exit 1
fi
if ! complete; then
  echo "$python has no headers or cannot make a virtual environment." >&2
  echo "On Debian: apt-get install python3-dev python3-venv. Or set PYTHON to another interpreter." >&2
  exit 1
fi
[[ -x $venv/bin/pip ]] || "$python" -m venv "$venv"

export CMAKE_BUILD_PARALLEL_LEVEL=${GSNAV_JOBS:-$("$root/tools/build_jobs.sh")}
if command -v ccache > /dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
echo "Installing what the build and the tests need in $venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check "scikit-build-core>=0.11" "nanobind>=2.8" \
  "numpy>=1.26" "gymnasium>=1.1" "greenlet>=3" "matplotlib>=3.8" "mypy>=1.11" "numpy-quaternion" "pytest>=8" \
  "pytest-timeout>=2.3" "pytest-xdist>=3.6" ${GSNAV_TEST_WITH:-}
echo "Building the package, $CMAKE_BUILD_PARALLEL_LEVEL files at a time"
# The build folder is kept, so that only changed files are compiled.
"$venv/bin/pip" install --disable-pip-version-check --no-build-isolation --no-deps --force-reinstall \
  --config-settings=build-dir="$build" --config-settings=cmake.define.GSNAV_TOOLS=ON \
  --config-settings=cmake.define.GSNAV_STUBS=$stubs --config-settings=cmake.define.GSNAV_WERROR="${GSNAV_WERROR:-OFF}" \
  --config-settings=cmake.define.CMAKE_CXX_FLAGS_RELEASE="$flags" "$root"
cd "$root"
if [[ $stubs == ON ]]; then
  # Programs of C++ whose images the tests compare with.
  cmake --build "$build" --target gsnav-render --target gsnav_python_reference -j "$CMAKE_BUILD_PARALLEL_LEVEL"
  export GSNAV_TOOLS_DIR=$build/tools GSNAV_PYTHON_REFERENCE=$build/bindings/python/gsnav_python_reference
  echo "Checking the types of the package"
  (cd "$build" && "$venv/bin/python" -m mypy --strict -p gsnav)
  echo "Comparing docs/reference/python.md with the package"
  "$venv/bin/python" tools/make_python_page.py --stubs "$build/bindings/python/_gsnav.pyi" --check
fi
echo "Testing"
workers=$((CMAKE_BUILD_PARALLEL_LEVEL < 8 ? CMAKE_BUILD_PARALLEL_LEVEL : 8))
# A test that hangs ends its process, after it has said where.
exec "${run[@]}" "$venv/bin/python" -m pytest -n "$workers" --dist loadfile \
  --timeout="$timeout" --timeout-method=thread "$@"
