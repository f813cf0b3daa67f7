# SPDX-License-Identifier: Apache-2.0
"""Exceptions."""

from typing import Any


class GreedyFollowerError(RuntimeError):
    """A follower cannot reach its goal."""


class InvalidAttachedObject(RuntimeError):
    """An object's node is gone."""


def assert_obj_valid(obj: Any) -> None:
    """Raises InvalidAttachedObject for None."""
    if obj is None:
        raise InvalidAttachedObject("the object has no node")
