# SPDX-License-Identifier: Apache-2.0
"""Seeded faults, and the test cases that must notice them (tests/mutation/mutate.py).

Each module here has a list FAULTS. The tokens to replace stand once in the function, whatever its file. A fault of a
rule that several backends use names them in `on`: the cases must fail on each of them alone. A fault names none if its
rule comes before a backend is asked (files, motion), if its case judges a formula in every lane type without a
renderer, or if its case compares backends with each other. A test that is device code (.cu) runs on the emulated CUDA
runtime.
"""
from __future__ import annotations

from dataclasses import dataclass


# Renderers of hard cases that share the formulas, and the backends that they use.
BACKENDS = ("serial", "openmp", "cuda float")
# Regions list rows before their ellipse is known. They draw no meshes, no other response and of the depths only
# the median.
BY_TILES = ("serial", "openmp", "cuda float", "cuda tiles")
EVERY = ("serial", "openmp", "cuda float", "cuda tiles", "cuda regions")
# Small images of few cameras have small tiles, lists in bins and a kernel of their own. "cuda many" draws the same
# images among many cameras, as large images are drawn.
BY_ALL_TILES = (*BY_TILES, "cuda many")
EVERY_WAY = (*EVERY, "cuda many")


@dataclass(frozen=True)
class Edit:
    function: str  # or struct or constant; "Outer::inner" where `inner` alone says too little
    old: str       # tokens that stand in it exactly once
    new: str


@dataclass(frozen=True)
class Fault:
    name: str
    edits: tuple[Edit, ...]
    source: str             # the test's translation unit, relative to the source tree
    cases: tuple[str, ...]  # doctest cases in it; each must fail
    why: str = ""
    more: tuple[str, ...] = ()  # compiled with it: what the test needs of the libraries
    on: tuple[str, ...] = ()    # backends of hard cases, each of which must notice it by itself
    device: bool = False        # a test of no hard case that runs on the emulated CUDA runtime

    @property
    def on_device(self) -> bool:
        """Whether the test needs the emulated CUDA runtime."""
        return self.device or self.source.endswith(".cu") or any(name.startswith("cuda") for name in self.on)


def fault(name: str, function: str, old: str, new: str, source: str, *cases: str, why: str = "",
          more: tuple[str, ...] = (), on: tuple[str, ...] = (), device: bool = False) -> Fault:
    """The usual kind: one edit."""
    return Fault(name, (Edit(function, old, new),), source, cases, why, more, on, device)
