# SPDX-License-Identifier: Apache-2.0
"""Naive formulas to put back, and the test cases that must notice (tools/planted_regressions.py).

Each module here has a list PLANTS. Edits are exact text that occurs once in its file.
"""
from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Edit:
    file: str  # relative to the source tree
    old: str   # occurs exactly once
    new: str


@dataclass(frozen=True)
class Plant:
    name: str
    edits: tuple[Edit, ...]
    source: str             # the test's translation unit, relative to the source tree
    cases: tuple[str, ...]  # doctest cases in it; each must fail
    why: str = ""
    more: tuple[str, ...] = ()  # compiled with it: what the test needs of the libraries


def plant(name: str, file: str, old: str, new: str, source: str, *cases: str, why: str = "",
          more: tuple[str, ...] = ()) -> Plant:
    """The usual kind: one edit."""
    return Plant(name, (Edit(file, old, new),), source, cases, why, more)
