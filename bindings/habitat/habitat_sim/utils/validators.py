# SPDX-License-Identifier: Apache-2.0
"""Validators for classes of attrs."""

import contextlib
from typing import Any

import numpy as np

from magnum import Quaternion


class NoAttrValidationContext(contextlib.ContextDecorator):
    """Turns the validators of attrs off inside a with statement or a function."""

    def __enter__(self) -> None:
        import attr

        self._before = attr.get_run_validators()
        attr.set_run_validators(False)

    def __exit__(self, *error: Any) -> None:
        import attr

        attr.set_run_validators(self._before)


def _numbers(value: Any) -> np.ndarray:
    if isinstance(value, Quaternion):
        return np.array(list(value.xyzw))
    if hasattr(value, "components"):
        return np.asarray(value.components)
    return np.asarray(value)


def all_is_finite(obj: Any, attribute: Any, value: Any) -> None:
    """Raises ValueError naming the attribute if a number is not finite."""
    if not np.isfinite(_numbers(value)).all():
        raise ValueError(f"{attribute.name} = {value}: has non-finite numbers")


def is_unit_length(obj: Any, attribute: Any, value: Any) -> None:
    """Raises ValueError naming the attribute if the length is not 1."""
    length = float(np.linalg.norm(_numbers(value)))
    if not np.isclose(length, 1.0, rtol=1e-4, atol=1e-4):
        kind = "no normalized quaternion" if _numbers(value).size == 4 else "not a unit length"
        raise ValueError(f"{attribute.name} = {value}: {kind}: the length is {length}")


def value_is_validated(obj: Any, attribute: Any, value: Any) -> None:
    """Validates the value, an object of attrs."""
    import attr

    attr.validate(value)
