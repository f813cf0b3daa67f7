# SPDX-License-Identifier: Apache-2.0
"""Angles with a unit: Rad and Deg."""

import math
from typing import Any


class _Angle:
    """An angle in one unit. Arithmetic keeps the unit of the left operand."""

    __slots__ = ("_value",)
    _degrees = False

    def __init__(self, value: Any = 0.0) -> None:
        """Takes a number in this unit, or an angle of either unit."""
        if isinstance(value, _Angle):
            value = value._in(self._degrees)
        self._value = float(value)

    def _in(self, degrees: bool) -> float:
        if degrees == self._degrees:
            return self._value
        return math.degrees(self._value) if degrees else math.radians(self._value)

    def __float__(self) -> float:
        return self._value

    def __neg__(self) -> Any:
        return type(self)(-self._value)

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, _Angle):
            return NotImplemented
        return type(self)(self._value + other._in(self._degrees))

    def __sub__(self, other: Any) -> Any:
        if not isinstance(other, _Angle):
            return NotImplemented
        return type(self)(self._value - other._in(self._degrees))

    def __mul__(self, factor: Any) -> Any:
        if isinstance(factor, _Angle):
            return NotImplemented
        return type(self)(self._value * float(factor))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        """The angle divided by a number, or the ratio of two angles."""
        if isinstance(other, _Angle):
            return self._value / other._in(self._degrees)
        return type(self)(self._value / float(other))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Angle):
            return NotImplemented
        return math.isclose(self._value, other._in(self._degrees), rel_tol=1e-6, abs_tol=1e-6)

    def __lt__(self, other: Any) -> bool:
        return self._value < other._in(self._degrees)

    def __le__(self, other: Any) -> bool:
        return self._value <= other._in(self._degrees)

    def __gt__(self, other: Any) -> bool:
        return self._value > other._in(self._degrees)

    def __ge__(self, other: Any) -> bool:
        return self._value >= other._in(self._degrees)

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> Any:
        return type(self), (self._value,)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._value:g})"


class Rad(_Angle):
    """Angle in radians."""

    __slots__ = ()


class Deg(_Angle):
    """Angle in degrees."""

    __slots__ = ()
    _degrees = True


def radians(angle: Any) -> float:
    """The radians of a Rad or Deg. Raises TypeError for a bare number, whose unit is unknown."""
    if not isinstance(angle, _Angle):
        raise TypeError(f"expected a magnum.Rad or magnum.Deg, got {angle!r}")
    return angle._in(False)
