# SPDX-License-Identifier: Apache-2.0
"""Functions of numbers, vectors, quaternions and ranges."""

import math as _math
from math import e, fmod, inf, nan, pi, sqrt
from typing import Any

from ._angle import Rad, radians
from ._matrix import _cross
from ._quaternion import Quaternion
from ._range import intersects, join
from ._vector import Vector3, _is_number, _Vector

sqrt2, sqrt3 = sqrt(2.0), sqrt(3.0)
pi_half, pi_quarter, tau = pi / 2, pi / 4, 2 * pi

__all__ = ["angle", "clamp", "cos", "cross", "dot", "e", "fmod", "half_angle", "inf", "intersects", "isinf", "isnan",
           "join", "lerp", "max", "min", "nan", "pi", "pi_half", "pi_quarter", "sin", "slerp", "sqrt", "sqrt2",
           "sqrt3", "tan", "tau"]  # fmt: skip


def dot(a: Any, b: Any) -> float:
    """Dot product of two vectors or quaternions."""
    if isinstance(a, Quaternion):
        return sum(x * y for x, y in zip(a._q, b._q))
    if not isinstance(a, _Vector):
        a = type(b)._of(a) if isinstance(b, _Vector) else Vector3._of(a)
    return a.dot(b)


def cross(a: Any, b: Any) -> Any:
    """Cross product of two vectors of three components, or the z of that of two components."""
    if len(a) == 2:
        return a[0] * b[1] - a[1] * b[0]
    return _cross(Vector3._of(a), Vector3._of(b))


def _arccos(x: float) -> Rad:
    return Rad(_math.acos(x if -1 <= x <= 1 else _math.copysign(1.0, x)))


def angle(a: Any, b: Any) -> Rad:
    """Angle between two vectors of length 1. Raises ValueError for another length. For two quaternions it is half the
    angle of the rotation between them."""
    if not (a.is_normalized() and b.is_normalized()):
        raise ValueError(f"magnum.math.angle: {a!r} or {b!r} does not have length 1")
    return _arccos(dot(a, b))


def half_angle(a: Quaternion, b: Quaternion) -> Rad:
    """Half the angle of the rotation between two quaternions of length 1."""
    return angle(a, b)


def _each(f: Any, *arguments: Any) -> Any:
    kind = next((type(a) for a in arguments if isinstance(a, _Vector)), None)
    if kind is None:
        return f(*arguments)
    rows = [[float(a)] * kind._size if _is_number(a) else kind._of(a) for a in arguments]
    return kind(*(f(*row) for row in zip(*rows)))


def min(a: Any, b: Any) -> Any:  # noqa: A001
    """Smaller number, by components."""
    return _each(lambda x, y: x if x < y else y, a, b)


def max(a: Any, b: Any) -> Any:  # noqa: A001
    """Larger number, by components."""
    return _each(lambda x, y: x if x > y else y, a, b)


def clamp(value: Any, low: Any, high: Any) -> Any:
    """The value brought into [low, high], by components."""
    return min(max(value, low), high)


def lerp(a: Any, b: Any, t: float) -> Any:
    """Linear interpolation; a quaternion is normalized."""
    mixed = a * (1 - t) + b * t
    return mixed.normalized() if isinstance(a, Quaternion) else mixed


def slerp(a: Quaternion, b: Quaternion, t: float) -> Quaternion:
    """Spherical interpolation of two quaternions of length 1. Raises ValueError for another length."""
    a._need_unit("slerp"), b._need_unit("slerp")
    cosine = dot(a, b)
    if abs(cosine) >= 1 - 1e-6:
        return Quaternion(a.vector, a.scalar)
    whole = _math.acos(cosine)
    return (a * _math.sin((1 - t) * whole) + b * _math.sin(t * whole)) / _math.sin(whole)


def sin(a: Any) -> float:
    """Sine of a Rad or Deg."""
    return _math.sin(radians(a))


def cos(a: Any) -> float:
    """Cosine of a Rad or Deg."""
    return _math.cos(radians(a))


def tan(a: Any) -> float:
    """Tangent of a Rad or Deg."""
    return _math.tan(radians(a))


def isnan(value: Any) -> Any:
    """Whether a number is NaN."""
    return _math.isnan(value)


def isinf(value: Any) -> Any:
    """Whether a number is infinite."""
    return _math.isinf(value)
