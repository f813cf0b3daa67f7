#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Makes the packages of a build and checks what is in them.
# usage: package_contents.sh CPACK BUILD_FOLDER FOLDER_FOR_PACKAGES VERSION
set -euo pipefail
cpack=$1 build=$2 out=$3 version=$4

failed=0
fail() { echo "FAILED: $*"; failed=1; }

rm -rf "$out"
"$cpack" --config "$build/CPackConfig.cmake" -B "$out" > "$out.log" 2>&1 || { cat "$out.log"; exit 1; }
rm -rf "$out/_CPack_Packages"

archive=$(echo "$out"/gsnav-"$version"-*.tar.gz)
[[ -f $archive ]] || { echo "FAILED: cpack made no $archive"; exit 1; }
# Paths below the prefix, one a line.
tar -tzf "$archive" | sed 's|^[^/]*/||' > "$out/archive.txt"
lists=("$out/archive.txt")

if command -v dpkg-deb > /dev/null && command -v dpkg-shlibdeps > /dev/null; then
  deb=$(echo "$out"/gsnav_"$version"-*.deb)
  [[ -f $deb ]] || { echo "FAILED: cpack made no $deb"; exit 1; }
  dpkg-deb --fsys-tarfile "$deb" | tar -t > "$out/deb_paths.txt"
  grep -v '^\./\(usr/.*\)\?$' "$out/deb_paths.txt" | grep -v '^\./usr$' && fail "the paths above are outside of /usr"
  grep '^\./usr/local' "$out/deb_paths.txt" && fail "the paths above are for what is not packaged"
  sed -n 's|^\./usr/||p' "$out/deb_paths.txt" > "$out/deb.txt"
  lists+=("$out/deb.txt")
  owners=$(dpkg-deb -c "$deb" | awk '{ print $2 }' | sort -u)
  [[ $owners == root/root ]] || fail "files belong to $owners, not to root"

  field() { dpkg-deb -f "$deb" "$1"; }
  [[ $(field Version) == "$version"-* ]] || fail "Version: $(field Version)"
  [[ $(field Architecture) == "$(dpkg --print-architecture)" ]] || fail "Architecture: $(field Architecture)"
  for name in Maintainer Description Section Installed-Size; do
    [[ -n $(field $name) ]] || fail "no field $name"
  done
  for library in libc6 libstdc++6 libgomp1 libpng16 libwebp libzstd1 zlib1g librecast; do
    [[ $(field Depends) == *$library* ]] || fail "Depends lacks $library: $(field Depends)"
  done
  for package in g++ cmake libpng-dev libwebp-dev libzstd-dev zlib1g-dev librecast-dev; do
    [[ $(field Recommends) == *$package* ]] || fail "Recommends lacks $package: $(field Recommends)"
  done
else
  echo "No dpkg-deb or no dpkg-shlibdeps: only the archive was checked"
fi

for list in "${lists[@]}"; do
  for path in bin/gsnav-render bin/gsnav-convert bin/gsnav-navmesh bin/gsnav-eval include/gsnav/gsnav.hpp \
              include/gsnav/backends/openmp.hpp 'lib.*/libgsnav_device.a' 'lib.*/cmake/gsnav/gsnavConfig.cmake' \
              share/pkgconfig/gsnav.pc share/doc/gsnav/copyright share/doc/gsnav/LICENSE; do
    grep -qx "$path" "$list" || fail "$(basename "$list" .txt): no $path"
  done
  grep -E '(^|/)(test_|bench_)|\.(o|cpp|cu)$' "$list" &&
    fail "$(basename "$list" .txt): the paths above are no part of a package"
done
[[ $failed -eq 0 ]] && echo "$(wc -l < "$out/archive.txt") paths in each package: as they should be"
exit $failed
