#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Checks the layout and the wording of text. C++ and CUDA sources are as clang-format 14 writes them, with 105 columns,
# or 120 with literals. Prose in Markdown has at most 105 columns; tables, code and links may be longer. Python, shell
# and CMake have at most 120. Wording follows CONTRIBUTING.md in all folders that tools/check_words.py names.
#
#   tools/check_format.sh          names what is wrong; exit status 1 where anything is
#   tools/check_format.sh --fix    formats the sources in place
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1:-} in
  "") options=(--dry-run -Werror) ;;
  --fix) options=(-i) ;;
  *)
    sed -n '4,10s/^# \{0,1\}//p' tools/check_format.sh
    exit $([[ $1 == --help || $1 == -h ]] && echo 0 || echo 2)
    ;;
esac
for program in clang-format git python3; do
  if ! command -v "$program" > /dev/null; then
    echo "$program is not installed (Debian: $program)" >&2
    exit 1
  fi
done
failed=0
git ls-files -z '*.hpp' '*.cpp' '*.cu' '*.cuh' | xargs -0 -n 64 -P "$(nproc)" clang-format "${options[@]}" || failed=1
git ls-files -z '*.md' | xargs -0 awk '
  FNR == 1 { code = 0 }
  /^ *```/ { code = !code }
  length($0) > 105 && !code && !/^ *\|/ && !/^    / && !/^[^ ]*$/ {
    printf "%s:%d: %d columns\n", FILENAME, FNR, length($0); wrong = 1
  }
  END { exit wrong }' || failed=1
git ls-files -z '*.hpp' '*.cpp' '*.cu' '*.cuh' '*.py' '*.sh' '*.cmake' '*.cmake.in' '*CMakeLists.txt' | xargs -0 awk '
  length($0) > 120 { printf "%s:%d: %d columns\n", FILENAME, FNR, length($0); wrong = 1 }
  END { exit wrong }' || failed=1
python3 tools/check_words.py || failed=1
if [[ $failed -ne 0 ]]; then
  echo "Lines above: run tools/check_format.sh --fix for sources; wrap prose at 105 columns, the rest at 120" >&2
fi
exit $failed
