# SPDX-License-Identifier: Apache-2.0
"""Vectors of 2 to 4 float32 components.

A vector is no numpy array: iteration and indexing give Python floats, `==` gives one bool, and arithmetic gives
a vector. `numpy.array(v)` is float32 with shape [n]. Functions that take a vector take any sequence of n numbers.
"""

import math
from array import array
from typing import Any, Iterator

_FUZZ = 1e-5


def close(a: float, b: float) -> bool:
    """Whether two float32 numbers differ by less than 1e-5, absolutely or relative to their sum. NaN equals NaN."""
    if a == b or (a != a and b != b):
        return True
    d = abs(a - b)
    return d < _FUZZ or d < _FUZZ * (abs(a) + abs(b)) < math.inf


class _Vector:
    """Common part of the vectors. `_size` is the number of components."""

    __slots__ = ("_v",)
    _size = 0

    def __init__(self, *values: Any) -> None:
        """Takes nothing (zeros), one number (for all components), n numbers, or parts with n numbers in all."""
        n = self._size
        if len(values) == 1 and type(values[0]) is type(self):
            self._v = values[0]._v[:]
            return
        if len(values) == n:
            try:
                self._v = array("f", values)
                return
            except TypeError:
                pass
        if not values:
            self._v = array("f", bytes(4 * n))
            return
        if len(values) == 1 and _is_number(values[0]):
            self._v = array("f", [float(values[0])] * n)
            return
        flat: list[float] = []
        for part in values:
            flat.extend([float(part)] if _is_number(part) else (float(x) for x in _items(part, type(self))))
        if len(flat) != n:
            raise TypeError(f"{type(self).__name__} takes {n} numbers, got {len(flat)}: {values!r}")
        self._v = array("f", flat)

    @classmethod
    def _of(cls, value: Any) -> Any:
        """`value` as a vector of this type. Raises TypeError if it is no sequence of n numbers."""
        if type(value) is cls:
            return value
        made = cls.__new__(cls)
        made._v = array("f", [float(x) for x in _items(value, cls)])
        if len(made._v) != cls._size:
            raise TypeError(f"expected {cls._size} numbers for a {cls.__name__}, got {value!r}")
        return made

    @classmethod
    def zero_init(cls) -> Any:
        """The zero vector."""
        return cls()

    # ---- A sequence of floats
    def __len__(self) -> int:
        return self._size

    def __getitem__(self, index: int) -> float:
        return self._v[index]

    def __setitem__(self, index: int, value: float) -> None:
        self._v[index] = value

    def __iter__(self) -> Iterator[float]:
        return iter(self._v)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        import numpy

        made = numpy.array(self._v, dtype=numpy.float32)
        return made if dtype is None else made.astype(dtype, copy=False)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{x:.9g}' for x in self._v)})"

    def __reduce__(self) -> Any:
        return type(self), tuple(self._v)

    def __eq__(self, other: object) -> bool:
        try:
            values = self._of(other)._v
        except (TypeError, ValueError):
            return NotImplemented
        return all(map(close, self._v, values))

    def __ne__(self, other: object) -> bool:
        same = self.__eq__(other)
        return same if same is NotImplemented else not same

    __hash__ = None  # type: ignore[assignment]

    # ---- Arithmetic
    def _with(self, values: Any) -> Any:
        made = type(self).__new__(type(self))
        made._v = array("f", values)
        return made

    def _operand(self, other: Any) -> Any:
        """The components of the other operand, or None if it is neither a number nor n numbers."""
        if _is_number(other):
            return [float(other)] * self._size
        if hasattr(other, "_v") and len(other._v) == self._size:
            return other._v
        try:
            return self._of(other)._v
        except (TypeError, ValueError):
            return None

    def __add__(self, other: Any) -> Any:
        b = None if _is_number(other) else self._operand(other)
        return NotImplemented if b is None else self._with([x + y for x, y in zip(self._v, b)])

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        b = None if _is_number(other) else self._operand(other)
        return NotImplemented if b is None else self._with([x - y for x, y in zip(self._v, b)])

    def __rsub__(self, other: Any) -> Any:
        b = None if _is_number(other) else self._operand(other)
        return NotImplemented if b is None else self._with([y - x for x, y in zip(self._v, b)])

    def __mul__(self, other: Any) -> Any:
        b = self._operand(other)
        return NotImplemented if b is None else self._with([x * y for x, y in zip(self._v, b)])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        b = self._operand(other)
        return NotImplemented if b is None else self._with([_quotient(x, y) for x, y in zip(self._v, b)])

    def __rtruediv__(self, other: Any) -> Any:
        b = self._operand(other)
        return NotImplemented if b is None else self._with([_quotient(y, x) for x, y in zip(self._v, b)])

    def __neg__(self) -> Any:
        return self._with([-x for x in self._v])

    # ---- Measures
    def dot(self, other: Any = None) -> float:
        """Squared length."""
        if other is not None:
            return sum(x * y for x, y in zip(self._v, self._of(other)._v))
        return sum(x * x for x in self._v)

    def length(self) -> float:
        """Length."""
        return math.sqrt(self.dot())

    def length_inverted(self) -> float:
        """Inverse of the length; infinite for the zero vector."""
        return _quotient(1.0, self.length())

    def normalized(self) -> Any:
        """Vector of length 1 in the same direction; NaN for the zero vector."""
        return self / self.length()

    def resized(self, length: float) -> Any:
        """Vector of the given length in the same direction."""
        return self * (length / self.length())

    def is_zero(self) -> bool:
        """Whether the squared length is below 1e-10."""
        return self.dot() < _FUZZ * _FUZZ

    def is_normalized(self) -> bool:
        """Whether the squared length differs from 1 by less than 2e-5."""
        return abs(self.dot() - 1.0) < 2 * _FUZZ

    def projected(self, line: Any) -> Any:
        """Projection onto the line through the origin along `line`."""
        line = self._of(line)
        return line * (self.dot(line) / line.dot())

    def projected_onto_normalized(self, line: Any) -> Any:
        """Projection onto the line through the origin along `line`. Raises ValueError unless its length is 1."""
        line = self._of(line)
        if not line.is_normalized():
            raise ValueError(f"projected_onto_normalized: {line!r} does not have length 1")
        return line * self.dot(line)

    def sum(self) -> float:
        """Sum of the components."""
        return sum(self._v)

    def product(self) -> float:
        """Product of the components."""
        return math.prod(self._v)

    def min(self) -> float:
        """Smallest component."""
        return min(self._v)

    def max(self) -> float:
        """Largest component."""
        return max(self._v)

    def minmax(self) -> tuple[float, float]:
        """Smallest and largest component."""
        return min(self._v), max(self._v)

    def flipped(self) -> Any:
        """Vector with the components in reverse order."""
        return self._with(self._v[::-1])


def _is_number(value: Any) -> bool:
    """Whether a value is a real number of Python or numpy."""
    return isinstance(value, (int, float)) or (
        getattr(value, "shape", None) == () and getattr(value.dtype, "kind", "") in ("b", "i", "u", "f")
    )


def _items(value: Any, wanted: type) -> Any:
    if isinstance(value, _Vector):
        return value._v
    if isinstance(value, (str, bytes)) or not hasattr(value, "__iter__") or isinstance(value, dict):
        raise TypeError(f"expected numbers for a {wanted.__name__}, got {value!r}")
    if getattr(value, "ndim", 1) != 1:
        raise TypeError(f"expected one row of numbers for a {wanted.__name__}, got shape {value.shape}")
    return value


def _quotient(a: float, b: float) -> float:
    """The quotient of IEEE 754: infinite or NaN where Python raises."""
    if b != 0:
        return a / b
    return math.nan if a == 0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _component(index: int, name: str) -> Any:
    def get(self: Any) -> float:
        return self._v[index]

    def put(self: Any, value: float) -> None:
        self._v[index] = value

    return property(get, put, doc=f"Component {name}.")


def _part(size: int, name: str) -> Any:
    def get(self: Any) -> Any:
        return _PARTS[size](*self._v[:size])

    def put(self: Any, value: Any) -> None:
        self._v[:size] = _PARTS[size]._of(value)._v

    return property(get, put, doc=f"The components {name} as a vector.")


class Vector2(_Vector):
    """Vector of two components."""

    __slots__ = ()
    _size = 2
    x, y = _component(0, "x"), _component(1, "y")

    @classmethod
    def x_axis(cls, length: float = 1.0) -> "Vector2":
        """(length, 0)."""
        return cls(length, 0)

    @classmethod
    def y_axis(cls, length: float = 1.0) -> "Vector2":
        """(0, length)."""
        return cls(0, length)

    def perpendicular(self) -> "Vector2":
        """The vector turned by 90 degrees counter-clockwise."""
        return Vector2(-self.y, self.x)

    def aspect_ratio(self) -> float:
        """x / y."""
        return _quotient(self.x, self.y)


class Vector3(_Vector):
    """Vector of three components."""

    __slots__ = ()
    _size = 3
    x, y, z = _component(0, "x"), _component(1, "y"), _component(2, "z")
    r, g, b = _component(0, "r"), _component(1, "g"), _component(2, "b")
    xy = _part(2, "x and y")

    @classmethod
    def x_axis(cls, length: float = 1.0) -> "Vector3":
        """(length, 0, 0)."""
        return cls(length, 0, 0)

    @classmethod
    def y_axis(cls, length: float = 1.0) -> "Vector3":
        """(0, length, 0)."""
        return cls(0, length, 0)

    @classmethod
    def z_axis(cls, length: float = 1.0) -> "Vector3":
        """(0, 0, length)."""
        return cls(0, 0, length)

    x_scale, y_scale, z_scale = (
        classmethod(lambda cls, scale: cls(scale, 1, 1)),
        classmethod(lambda cls, scale: cls(1, scale, 1)),
        classmethod(lambda cls, scale: cls(1, 1, scale)),
    )


class Vector4(_Vector):
    """Vector of four components."""

    __slots__ = ()
    _size = 4
    x, y, z, w = _component(0, "x"), _component(1, "y"), _component(2, "z"), _component(3, "w")
    r, g, b, a = x, y, z, w
    xy, xyz, rgb = _part(2, "x and y"), _part(3, "x, y and z"), _part(3, "r, g and b")


_PARTS: dict[int, Any] = {2: Vector2, 3: Vector3, 4: Vector4}
