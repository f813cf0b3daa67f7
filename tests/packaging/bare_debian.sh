#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Installs the packages into a Debian 12 that has nothing else, runs the programs and compiles a program of a user.
# It takes minutes, root and a network, so it runs only where GSNAV_CHROOT_TEST=1 asks for it; else it exits with 77.
# usage: bare_debian.sh FOLDER_OF_PACKAGES WORK_FOLDER CONSUMER_SOURCES VERSION
#
# GSNAV_DEBIAN_MIRROR=URL   where debootstrap reads (default: http://deb.debian.org/debian)
set -euo pipefail
packages=$1 work=$2 sources=$3 version=$4

skip() { echo "Skipped: $*"; exit 77; }
[[ ${GSNAV_CHROOT_TEST:-0} == 1 ]] || skip "GSNAV_CHROOT_TEST=1 runs it (as root, with debootstrap and a network)"
[[ $(id -u) -eq 0 ]] || skip "only root can make a chroot"
command -v debootstrap > /dev/null || skip "debootstrap is not installed"
deb=$(echo "$packages"/gsnav_"$version"-*.deb)
[[ -f $deb ]] || skip "no Debian package in $packages"

mirror=${GSNAV_DEBIAN_MIRROR:-http://deb.debian.org/debian}
base=$work/bookworm.tar root=$work/root
mkdir -p "$work"
if [[ ! -f $base ]]; then
  rm -rf "$root"
  debootstrap --variant=minbase bookworm "$root" "$mirror" > "$work/debootstrap.log" 2>&1 ||
    { tail -n 20 "$work/debootstrap.log"; exit 1; }
  tar -C "$root" -cf "$base.part" . && mv "$base.part" "$base"
fi
rm -rf --one-file-system "$root" && mkdir "$root" && tar -C "$root" -xf "$base"
cp /etc/resolv.conf "$root/etc/resolv.conf"

inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive "$@"; }
apt() { inside apt-get -qq -o Dpkg::Use-Pty=0 "$@" > "$work/apt.log" 2>&1 || { tail -n 20 "$work/apt.log"; exit 1; }; }
step() { echo "== $* ($SECONDS s)"; }
programs() {  # of the prefix $1: each says what it is, and one plays an episode
  local program
  for program in render convert navmesh avatar eval replay scene viewer; do
    inside "$1/bin/gsnav-$program" --help > "$work/help.txt"
    grep -q -- "--help" "$work/help.txt" || { echo "FAILED: gsnav-$program --help"; cat "$work/help.txt"; exit 1; }
    if grep -q -- "--version" "$work/help.txt"; then
      inside "$1/bin/gsnav-$program" --version | grep -qF "$version" ||
        { echo "FAILED: gsnav-$program --version"; exit 1; }
    fi
  done
  inside "$1/bin/gsnav-eval" --episodes 1 --avatars 1 --out "/root/out$1" > "$work/eval.log" 2>&1 ||
    { tail -n 20 "$work/eval.log"; exit 1; }
  [[ -s $root/root/out$1/metrics.json ]] || { echo "FAILED: gsnav-eval wrote no metrics.json"; exit 1; }
}

step "the package alone, without what it recommends"
apt update
cp "$deb" "$root/root/gsnav.deb"
apt install -y --no-install-recommends /root/gsnav.deb
programs /usr

step "what it recommends, and a program of a user"
IFS=', ' read -ra recommended <<< "$(dpkg-deb -f "$deb" Recommends)"
apt install -y --no-install-recommends "${recommended[@]}" make
mkdir -p "$root/root/packaging"
cp -r "$sources/consumer" "$sources/find_package" "$root/root/packaging/"
inside cmake -S /root/packaging/find_package -B /root/build -DEXPECTED_VERSION="$version" \
  -DWANTED=openmp,avatar,rigging,io,nav,sim,device,demo,eval > "$work/configure.log" 2>&1 ||
  { tail -n 20 "$work/configure.log"; exit 1; }
inside cmake --build /root/build
inside sh -c "cd /root/build && ./consumer"

step "the archive, where the package was"
apt remove -y gsnav
mkdir -p "$root/opt/gsnav"
tar -C "$root/opt/gsnav" --strip-components=1 -xzf "$packages"/gsnav-"$version"-*.tar.gz
programs /opt/gsnav
step "all of it works"
rm -rf --one-file-system "$root"
