# SPDX-License-Identifier: Apache-2.0
"""How much memory this process may use."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Iterator


def _files(root: pathlib.Path) -> Iterator[pathlib.Path]:
    """Files with the limits of this process's control groups of Linux, version 1 and 2, and of those above them."""
    groups = root / "sys/fs/cgroup"
    for line in (root / "proc/self/cgroup").read_text().splitlines():
        _, controllers, group = line.split(":", 2)
        if not controllers:
            base, name = groups, "memory.max"
        elif "memory" in controllers.split(","):
            base, name = groups / "memory", "memory.limit_in_bytes"
        else:
            continue
        # In a container, the group may be a path of the host. The files of the container's group are in `base`.
        folder = base / group.lstrip("/")
        while folder != base:
            yield folder / name
            folder = folder.parent
        yield base / name


def limit(root: str = "/") -> int:
    """Bytes that this process may use: those of the machine, or of the control group that it runs in."""
    limits = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    try:
        for file in _files(pathlib.Path(root)):
            try:
                limits.append(int(file.read_text()))
            except (OSError, ValueError):  # There is no such group, or its limit is "max".
                continue
    except (OSError, ValueError):  # There are no control groups.
        pass
    return min(limits)


def lack(needed: float) -> str:
    """Text on the memory that is missing for this number of bytes, or "" if this process may use them.

    Linux may promise more memory than there is, and then kills the process that uses it.
    """
    present = limit()
    return f"{needed / 1e9:.3g} GB of {present / 1e9:.3g}" if needed > present > 0 else ""
