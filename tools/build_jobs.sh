#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Prints how many files to compile at a time: one per processor, and at most one per 1.5 GiB of memory.
set -euo pipefail
processors=$(nproc)
memory_kib=$(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo 2> /dev/null || true)
fit=$(( ${memory_kib:-$((processors * 1572864))} / 1572864 ))
jobs=$(( fit < processors ? fit : processors ))
echo $(( jobs > 0 ? jobs : 1 ))
