# SPDX-License-Identifier: Apache-2.0
"""Axis-aligned ranges of 1 to 3 dimensions."""

from typing import Any

from ._vector import Vector2, Vector3, close


class _Range:
    """From `min` to `max`, of numbers or vectors."""

    __slots__ = ("_min", "_max")
    _vector: Any = None

    def __init__(self, *ends: Any) -> None:
        """Takes nothing (zeros), a range, a pair, or the smallest and the largest point."""
        if len(ends) == 1:
            ends = (ends[0]._min, ends[0]._max) if isinstance(ends[0], _Range) else tuple(ends[0])
        if not ends:
            ends = (self._vector(), self._vector())
        if len(ends) != 2:
            raise TypeError(f"{type(self).__name__} takes two points, got {ends!r}")
        self._min, self._max = self._vector(ends[0]), self._vector(ends[1])

    @classmethod
    def from_size(cls, low: Any, size: Any) -> Any:
        """From `low` to `low + size`."""
        low = cls._vector(low)
        return cls(low, low + cls._vector(size))

    @classmethod
    def from_center(cls, center: Any, half_size: Any) -> Any:
        """From `center - half_size` to `center + half_size`."""
        center, half = cls._vector(center), cls._vector(half_size)
        return cls(center - half, center + half)

    @classmethod
    def zero_init(cls) -> Any:
        """From zero to zero."""
        return cls()

    @property
    def min(self) -> Any:
        """Smallest coordinates."""
        return self._vector(self._min)

    @min.setter
    def min(self, value: Any) -> None:
        self._min = self._vector(value)

    @property
    def max(self) -> Any:
        """Largest coordinates."""
        return self._vector(self._max)

    @max.setter
    def max(self, value: Any) -> None:
        self._max = self._vector(value)

    def size(self) -> Any:
        """Largest minus smallest coordinates."""
        return self._max - self._min

    def center(self) -> Any:
        """Middle of the range."""
        return (self._min + self._max) * 0.5

    def translated(self, vector: Any) -> Any:
        """The range moved by a vector."""
        v = self._vector(vector)
        return type(self)(self._min + v, self._max + v)

    def padded(self, padding: Any) -> Any:
        """The range with both ends moved outwards."""
        p = self._vector(padding)
        return type(self)(self._min - p, self._max + p)

    def scaled(self, scale: Any) -> Any:
        """Both ends multiplied."""
        return type(self)(self._min * scale, self._max * scale)

    def scaled_from_center(self, scale: Any) -> Any:
        """The size multiplied about the middle."""
        half = self.size() * scale * 0.5
        return type(self)(self.center() - half, self.center() + half)

    def contains(self, what: Any) -> bool:
        """Whether a point (excluding the largest end) or a range lies inside."""
        if isinstance(what, _Range):
            return all(a <= b and d <= c for a, b, c, d in zip(*map(_numbers, self._ends(what))))
        point = _numbers(self._vector(what))
        return all(a <= x < b for a, x, b in zip(_numbers(self._min), point, _numbers(self._max)))

    def _ends(self, other: Any) -> Any:
        return self._min, other._min, self._max, other._max

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        a = (*_numbers(self._min), *_numbers(self._max))
        return all(map(close, a, (*_numbers(other._min), *_numbers(other._max))))

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> Any:
        return type(self), (self._min, self._max)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._min!r}, {self._max!r})"


def _numbers(value: Any) -> tuple[float, ...]:
    return (value,) if isinstance(value, float) else tuple(value)


def _end(axis: int, largest: bool, name: str) -> Any:
    def get(self: Any) -> float:
        return (self._max if largest else self._min)[axis]

    def put(self: Any, value: float) -> None:
        (self._max if largest else self._min)[axis] = value

    return property(get, put, doc=f"The end on the {name}.")


def _corner(*largest: bool) -> Any:
    def get(self: Any) -> Any:
        return self._vector(*((self._max if top else self._min)[i] for i, top in enumerate(largest)))

    return property(get, doc="A corner.")


def _extent(axis: int, name: str) -> Any:
    def get(self: Any) -> float:
        return self._max[axis] - self._min[axis]

    get.__doc__ = f"Size along {name}."
    return get


def _middle(axis: int, name: str) -> Any:
    def get(self: Any) -> float:
        return (self._max[axis] + self._min[axis]) / 2

    get.__doc__ = f"Middle along {name}."
    return get


class Range1D(_Range):
    """Range of numbers."""

    __slots__ = ()
    _vector = float


class Range2D(_Range):
    """Rectangle."""

    __slots__ = ()
    _vector = Vector2
    left, right = _end(0, False, "left"), _end(0, True, "right")
    bottom, top = _end(1, False, "bottom"), _end(1, True, "top")
    bottom_left, bottom_right = _corner(False, False), _corner(True, False)
    top_left, top_right = _corner(False, True), _corner(True, True)
    size_x, size_y = _extent(0, "x"), _extent(1, "y")
    center_x, center_y = _middle(0, "x"), _middle(1, "y")


class Range3D(_Range):
    """Box."""

    __slots__ = ()
    _vector = Vector3
    left, right = _end(0, False, "left"), _end(0, True, "right")
    bottom, top = _end(1, False, "bottom"), _end(1, True, "top")
    back, front = _end(2, False, "back"), _end(2, True, "front")
    back_bottom_left, back_bottom_right = _corner(False, False, False), _corner(True, False, False)
    back_top_left, back_top_right = _corner(False, True, False), _corner(True, True, False)
    front_bottom_left, front_bottom_right = _corner(False, False, True), _corner(True, False, True)
    front_top_left, front_top_right = _corner(False, True, True), _corner(True, True, True)
    size_x, size_y, size_z = _extent(0, "x"), _extent(1, "y"), _extent(2, "z")
    center_x, center_y, center_z = _middle(0, "x"), _middle(1, "y"), _middle(2, "z")


def join(a: Any, b: Any) -> Any:
    """Smallest range that contains both."""
    low = [min(x, y) for x, y in zip(_numbers(a._min), _numbers(b._min))]
    high = [max(x, y) for x, y in zip(_numbers(a._max), _numbers(b._max))]
    return type(a)(*(e[0] if a._vector is float else e for e in (low, high)))


def intersects(a: Any, b: Any) -> bool:
    """Whether two ranges overlap."""
    ends = zip(*map(_numbers, (a._min, a._max, b._min, b._max)))
    return all(a1 > b0 and a0 < b1 for a0, a1, b0, b1 in ends)
