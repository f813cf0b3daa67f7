# SPDX-License-Identifier: Apache-2.0
"""Marks for a profiler. They do nothing here."""

from contextlib import contextmanager
from typing import Iterator


def configure(capture_start_step: int = -1, num_steps_to_capture: int = -1) -> None:
    """Does nothing."""


def on_start_step() -> None:
    """Does nothing."""


def range_push(message: str) -> None:
    """Does nothing."""


def range_pop() -> None:
    """Does nothing."""


@contextmanager
def RangeContext(message: str) -> Iterator[None]:  # noqa: N802
    """Does nothing."""
    yield
