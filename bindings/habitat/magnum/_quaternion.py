# SPDX-License-Identifier: Apache-2.0
"""Quaternions of a vector and a scalar."""

import math
from array import array
from typing import Any

from ._angle import Rad, radians
from ._vector import Vector3, Vector4, _is_number, close


class Quaternion:
    """Quaternion of float32 numbers: `vector` is the imaginary part, `scalar` the real part."""

    __slots__ = ("_q",)

    def __init__(self, *parts: Any) -> None:
        """Takes nothing (the identity), `(vector, scalar)`, or the two as arguments."""
        if not parts:
            self._q = array("f", (0, 0, 0, 1))
            return
        if len(parts) == 1:
            if isinstance(parts[0], Quaternion):
                self._q = parts[0]._q[:]
                return
            parts = tuple(parts[0])
        if len(parts) != 2:
            raise TypeError(f"Quaternion takes a vector and a scalar, got {parts!r}")
        self._q = array("f", (*Vector3._of(parts[0])._v, float(parts[1])))

    @classmethod
    def _xyzw(cls, x: float, y: float, z: float, w: float) -> "Quaternion":
        made = cls.__new__(cls)
        made._q = array("f", (x, y, z, w))
        return made

    @classmethod
    def _of(cls, value: Any) -> "Quaternion":
        if isinstance(value, Quaternion):
            return value
        if hasattr(value, "imag") and hasattr(value, "real") and getattr(value.imag, "shape", None) == (3,):
            return cls(value.imag, value.real)  # A quaternion of numpy-quaternion.
        return cls(value)

    # ---- Constructors
    @classmethod
    def identity_init(cls) -> "Quaternion":
        """No rotation."""
        return cls()

    @classmethod
    def zero_init(cls) -> "Quaternion":
        """All components 0."""
        return cls._xyzw(0, 0, 0, 0)

    @classmethod
    def rotation(cls, angle: Any, axis: Any) -> "Quaternion":
        """Rotation by a Rad or Deg about an axis of length 1. Raises ValueError for another length."""
        axis = Vector3._of(axis)
        if not axis.is_normalized():
            raise ValueError(f"Quaternion.rotation: axis {axis!r} does not have length 1")
        half = radians(angle) / 2
        return cls(axis * math.sin(half), math.cos(half))

    @classmethod
    def from_matrix(cls, matrix: Any) -> "Quaternion":
        """Rotation of a Matrix3. Raises ValueError if it is no rotation."""
        m = [[float(matrix[c][r]) for c in range(3)] for r in range(3)]
        for a in range(3):
            for b in range(a, 3):
                if abs(sum(m[r][a] * m[r][b] for r in range(3)) - (a == b)) > 1e-4:
                    raise ValueError(f"Quaternion.from_matrix: {matrix!r} is no rotation")
        # The largest component is found first, so that no small number is a divisor.
        squares = [1 + m[0][0] - m[1][1] - m[2][2], 1 - m[0][0] + m[1][1] - m[2][2],
                   1 - m[0][0] - m[1][1] + m[2][2], 1 + m[0][0] + m[1][1] + m[2][2]]  # fmt: skip
        k = max(range(4), key=squares.__getitem__)
        s = 2 * math.sqrt(squares[k])
        sums = (m[1][0] + m[0][1], m[2][0] + m[0][2], m[2][1] + m[1][2])
        turns = (m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1])
        rows = [
            (s * s / 4, sums[0], sums[1], turns[0]),
            (sums[0], s * s / 4, sums[2], turns[1]),
            (sums[1], sums[2], s * s / 4, turns[2]),
            (turns[0], turns[1], turns[2], s * s / 4),
        ]
        return cls._xyzw(*(x / s for x in rows[k]))

    # ---- Parts
    @property
    def vector(self) -> Vector3:
        """Imaginary part, a copy."""
        return Vector3(*self._q[:3])

    @vector.setter
    def vector(self, value: Any) -> None:
        self._q[:3] = Vector3._of(value)._v

    @property
    def scalar(self) -> float:
        """Real part."""
        return self._q[3]

    @scalar.setter
    def scalar(self, value: float) -> None:
        self._q[3] = value

    @property
    def xyzw(self) -> Vector4:
        """The imaginary part and then the real part."""
        return Vector4(*self._q)

    @property
    def wxyz(self) -> Vector4:
        """The real part and then the imaginary part."""
        return Vector4(self._q[3], *self._q[:3])

    # ---- Measures
    def dot(self) -> float:
        """Squared length."""
        x, y, z, w = self._q
        return x * x + y * y + z * z + w * w

    def length(self) -> float:
        """Length."""
        return math.sqrt(self.dot())

    def is_normalized(self) -> bool:
        """Whether the squared length differs from 1 by less than 2e-5."""
        return abs(self.dot() - 1) < 2e-5

    def _need_unit(self, method: str) -> None:
        if not self.is_normalized():
            raise ValueError(f"Quaternion.{method}: {self!r} does not have length 1")

    def normalized(self) -> "Quaternion":
        """The quaternion with length 1."""
        return self / self.length()

    def angle(self) -> Rad:
        """Angle of the rotation, 0 to 2 pi. Raises ValueError unless the length is 1."""
        self._need_unit("angle")
        return Rad(2 * math.acos(max(-1.0, min(1.0, self._q[3]))))

    def axis(self) -> Vector3:
        """Axis of the rotation; NaN for no rotation. Raises ValueError unless the length is 1."""
        self._need_unit("axis")
        return self.vector.normalized()

    def conjugated(self) -> "Quaternion":
        """The quaternion with the opposite vector."""
        x, y, z, w = self._q
        return Quaternion._xyzw(-x, -y, -z, w)

    def inverted(self) -> "Quaternion":
        """The inverse of any quaternion."""
        return self.conjugated() / self.dot()

    def inverted_normalized(self) -> "Quaternion":
        """The inverse of a quaternion of length 1. Raises ValueError for another length."""
        self._need_unit("inverted_normalized")
        return self.conjugated()

    # ---- Rotating
    def transform_vector(self, vector: Any) -> Vector3:
        """The vector rotated by this quaternion of any length but 0."""
        return self.normalized()._turned(vector)

    def transform_vector_normalized(self, vector: Any) -> Vector3:
        """The vector rotated by this quaternion of length 1. Raises ValueError for another length."""
        self._need_unit("transform_vector_normalized")
        return self._turned(vector)

    def _turned(self, vector: Any) -> Vector3:
        a, b, c = Vector3._of(vector)._v
        x, y, z, w = self._q
        tx, ty, tz = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        return Vector3(a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)

    def to_matrix(self) -> Any:
        """The rotation as a Matrix3."""
        from ._matrix import Matrix3

        return Matrix3(*(self._turned(a) for a in ((1, 0, 0), (0, 1, 0), (0, 0, 1))))

    # ---- Operators
    def _with(self, values: Any) -> "Quaternion":
        return Quaternion._xyzw(*values)

    def __mul__(self, other: Any) -> Any:
        """The product with a quaternion, also of numpy-quaternion, that is applied first, or with a number."""
        if _is_number(other):
            return self._with(x * float(other) for x in self._q)
        if not isinstance(other, Quaternion):
            if not hasattr(other, "components"):
                return NotImplemented
            other = Quaternion._of(other)
        ax, ay, az, aw = self._q
        bx, by, bz, bw = other._q
        return Quaternion._xyzw(
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        )

    def __rmul__(self, other: Any) -> Any:
        if _is_number(other):
            return self * other
        return Quaternion._of(other) * self if hasattr(other, "components") else NotImplemented

    def __truediv__(self, other: Any) -> Any:
        x, y, z, w = self._q
        d = float(other)
        return Quaternion._xyzw(x / d, y / d, z / d, w / d)

    def __add__(self, other: Any) -> Any:
        if not isinstance(other, Quaternion):
            return NotImplemented
        return self._with(x + y for x, y in zip(self._q, other._q))

    def __sub__(self, other: Any) -> Any:
        if not isinstance(other, Quaternion):
            return NotImplemented
        return self._with(x - y for x, y in zip(self._q, other._q))

    def __neg__(self) -> "Quaternion":
        return self._with(-x for x in self._q)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Quaternion):
            return NotImplemented
        return all(map(close, self._q, other._q))

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> Any:
        return Quaternion, ((tuple(self._q[:3]), self._q[3]),)

    def __repr__(self) -> str:
        x, y, z, w = self._q
        return f"Quaternion({{{x:.9g}, {y:.9g}, {z:.9g}}}, {w:.9g})"
