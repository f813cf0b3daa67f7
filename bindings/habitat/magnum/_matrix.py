# SPDX-License-Identifier: Apache-2.0
"""Matrices of 3 x 3 and 4 x 4 float32 numbers, stored by columns.

`m[c]` is a column, `m[c, r]` a number. `numpy.array(m)` has the shape [row][column] of mathematics, and a matrix
can be made from such an array. `@` multiplies.
"""

import math
from array import array
from typing import Any, Callable

from ._angle import radians
from ._quaternion import Quaternion
from ._vector import Vector3, Vector4, _is_number, _Vector, close


class _Both:
    """A name that is a function of the class and something else of its objects."""

    def __init__(self, of_class: Callable[..., Any], of_object: Any) -> None:
        self._of_class, self._of_object = of_class, of_object
        self.__doc__ = of_class.__doc__

    def __get__(self, instance: Any, owner: Any) -> Any:
        if instance is None:
            return self._of_class.__get__(None, owner) if hasattr(self._of_class, "__get__") else self._of_class
        return self._of_object.__get__(instance, owner)

    def __set__(self, instance: Any, value: Any) -> None:
        self._of_object.__set__(instance, value)


class _Matrix:
    """Common part of the matrices."""

    __slots__ = ("_c",)
    _size = 0
    _column: Any = None

    def __init__(self, *columns: Any) -> None:
        """Takes nothing (the identity), one number (for the diagonal), columns, or an array [row][column]."""
        n = self._size
        if not columns or (len(columns) == 1 and _is_number(columns[0])):
            d = float(columns[0]) if columns else 1.0
            columns = tuple([d if r == c else 0.0 for r in range(n)] for c in range(n))
        elif len(columns) == 1 and isinstance(columns[0], _Matrix):
            m = columns[0]._c
            k = min(n, len(m))
            columns = tuple([m[c][r] if c < k and r < k else float(c == r) for r in range(n)] for c in range(n))
        elif len(columns) == 1:
            rows = columns[0]
            columns = tuple([float(rows[r][c]) for r in range(len(rows))] for c in range(n))
        if len(columns) != n:
            raise TypeError(f"{type(self).__name__} takes {n} columns, got {len(columns)}")
        self._c = [array("f", self._column._of(c)._v) for c in columns]

    @classmethod
    def identity_init(cls, value: float = 1.0) -> Any:
        """The matrix with `value` on its diagonal."""
        return cls(value)

    @classmethod
    def zero_init(cls) -> Any:
        """All numbers 0."""
        return cls(0.0)

    @classmethod
    def from_diagonal(cls, diagonal: Any) -> Any:
        """The matrix with these numbers on its diagonal."""
        d = cls._column._of(diagonal)._v
        return cls(*([d[c] if r == c else 0.0 for r in range(cls._size)] for c in range(cls._size)))

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            return self._c[index[0]][index[1]]
        return self._column(*self._c[index])

    def __setitem__(self, index: Any, value: Any) -> None:
        if isinstance(index, tuple):
            self._c[index[0]][index[1]] = value
        else:
            self._c[index][:] = self._column._of(value)._v

    def row(self, index: int) -> Any:
        """A row as a vector."""
        return self._column(*(c[index] for c in self._c))

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        import numpy

        made = numpy.array(self._c, dtype=numpy.float32).T.copy()
        return made if dtype is None else made.astype(dtype, copy=False)

    def __matmul__(self, other: Any) -> Any:
        n = range(self._size)
        if isinstance(other, type(self)):
            return type(self)(*([sum(self._c[k][r] * c[k] for k in n) for r in n] for c in other._c))
        if isinstance(other, _Vector) and len(other) == self._size:
            return type(other)(*(sum(self._c[k][r] * other._v[k] for k in n) for r in n))
        return NotImplemented

    def _map(self, f: Callable[[float], float]) -> Any:
        return type(self)(*([f(x) for x in c] for c in self._c))

    def __mul__(self, number: Any) -> Any:
        if not _is_number(number):
            return NotImplemented
        return self._map(lambda x: x * float(number))

    __rmul__ = __mul__

    def __truediv__(self, number: Any) -> Any:
        return self._map(lambda x: x / float(number)) if _is_number(number) else NotImplemented

    def __neg__(self) -> Any:
        return self._map(lambda x: -x)

    def _zip(self, other: Any, f: Callable[[float, float], float]) -> Any:
        if not isinstance(other, type(self)):
            return NotImplemented
        return type(self)(*([f(x, y) for x, y in zip(a, b)] for a, b in zip(self._c, other._c)))

    def __add__(self, other: Any) -> Any:
        return self._zip(other, lambda x, y: x + y)

    def __sub__(self, other: Any) -> Any:
        return self._zip(other, lambda x, y: x - y)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, type(self)):
            return NotImplemented
        return all(close(x, y) for a, b in zip(self._c, other._c) for x, y in zip(a, b))

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> Any:
        return type(self), tuple(tuple(c) for c in self._c)

    def __repr__(self) -> str:
        rows = (", ".join(f"{c[r]:.9g}" for c in self._c) for r in range(self._size))
        return f"{type(self).__name__}([{'; '.join(rows)}])"

    def transposed(self) -> Any:
        """Rows and columns exchanged."""
        return type(self)(*([c[r] for c in self._c] for r in range(self._size)))

    def diagonal(self) -> Any:
        """The diagonal as a vector."""
        return self._column(*(self._c[i][i] for i in range(self._size)))

    def trace(self) -> float:
        """Sum of the diagonal."""
        return sum(self._c[i][i] for i in range(self._size))

    def determinant(self) -> float:
        """Determinant."""
        import numpy

        return float(numpy.linalg.det(self.__array__().astype(float)))

    def inverted(self) -> Any:
        """The inverse. Raises numpy.linalg.LinAlgError if there is none."""
        import numpy

        return type(self)(numpy.linalg.inv(self.__array__().astype(float)))

    def inverted_orthogonal(self) -> Any:
        """The inverse of an orthogonal matrix: its transpose."""
        return self.transposed()


class Matrix3(_Matrix):
    """Matrix of 3 x 3 numbers: a rotation of vectors of three components."""

    __slots__ = ()
    _size = 3
    _column = Vector3

    @classmethod
    def rotation(cls, angle: Any) -> "Matrix3":
        """Rotation by a Rad or Deg in the plane of x and y."""
        s, c = math.sin(radians(angle)), math.cos(radians(angle))
        return cls((c, s, 0), (-s, c, 0), (0, 0, 1))

    @classmethod
    def translation(cls, vector: Any) -> "Matrix3":
        """Translation in the plane."""
        x, y = vector
        return cls((1, 0, 0), (0, 1, 0), (x, y, 1))


def _linear(m: "Matrix4") -> Matrix3:
    """Upper left 3 x 3 part."""
    return Matrix3(*(c[:3] for c in m._c[:3]))


class Matrix4(_Matrix):
    """Matrix of 4 x 4 numbers: a transformation of space."""

    __slots__ = ()
    _size = 4
    _column = Vector4

    # ---- Constructors
    @classmethod
    def _translation(cls, vector: Any) -> "Matrix4":
        """On the class, makes a translation. On an object, its translation, which can be assigned."""
        made = cls()
        made._c[3][:3] = Vector3._of(vector)._v
        return made

    @classmethod
    def _rotation(cls, angle: Any, axis: Any) -> "Matrix4":
        """On the class, makes a rotation by an angle about an axis of length 1. On an object, returns its rotation."""
        return cls.from_(Quaternion.rotation(angle, axis).to_matrix(), Vector3())

    @classmethod
    def _scaling(cls, vector: Any) -> "Matrix4":
        """On the class, makes a scaling. On an object, returns the lengths of its first three columns."""
        return cls.from_diagonal((*Vector3._of(vector), 1.0))

    @classmethod
    def from_(cls, rotation_scaling: Any, translation: Any) -> "Matrix4":
        """A Matrix3 followed by a translation."""
        m = rotation_scaling if isinstance(rotation_scaling, Matrix3) else Matrix3(rotation_scaling)
        return cls(*((*c, 0.0) for c in m._c), (*Vector3._of(translation), 1.0))

    @classmethod
    def rotation_x(cls, angle: Any) -> "Matrix4":
        """Rotation by a Rad or Deg about x."""
        return cls.rotation(angle, Vector3.x_axis())

    @classmethod
    def rotation_y(cls, angle: Any) -> "Matrix4":
        """Rotation by a Rad or Deg about y."""
        return cls.rotation(angle, Vector3.y_axis())

    @classmethod
    def rotation_z(cls, angle: Any) -> "Matrix4":
        """Rotation by a Rad or Deg about z."""
        return cls.rotation(angle, Vector3.z_axis())

    @classmethod
    def look_at(cls, eye: Any, target: Any, up: Any) -> "Matrix4":
        """Camera at `eye` whose -z points to `target`: from its frame to the world."""
        eye = Vector3._of(eye)
        backward = (eye - Vector3._of(target)).normalized()
        right = _cross(Vector3._of(up), backward).normalized()
        return cls.from_(Matrix3(right, _cross(backward, right), backward), eye)

    @classmethod
    def perspective_projection(cls, fov: Any, aspect_ratio: float, near: float, far: float) -> "Matrix4":
        """OpenGL's projection with a horizontal field of view."""
        x = 1 / math.tan(radians(fov) / 2)
        return cls(
            (x, 0, 0, 0), (0, x * aspect_ratio, 0, 0),
            (0, 0, (near + far) / (near - far), -1), (0, 0, 2 * near * far / (near - far), 0),
        )  # fmt: skip

    # ---- Parts
    def _get_translation(self) -> Vector3:
        return Vector3(*self._c[3][:3])

    def _set_translation(self, value: Any) -> None:
        self._c[3][:3] = Vector3._of(value)._v

    def rotation_scaling(self) -> Matrix3:
        """Upper left 3 x 3 part."""
        return _linear(self)

    def rotation_normalized(self) -> Matrix3:
        """Upper left part, which must be a rotation. Raises ValueError if it is none."""
        Quaternion.from_matrix(_linear(self))
        return _linear(self)

    def rotation_shear(self) -> Matrix3:
        """Upper left part with columns of length 1."""
        return Matrix3(*(Vector3(*c[:3]).normalized() for c in self._c[:3]))

    def _get_rotation(self) -> Matrix3:
        r = self.rotation_shear()
        Quaternion.from_matrix(r)
        return r

    def _get_scaling(self) -> Vector3:
        return Vector3(*(Vector3(*c[:3]).length() for c in self._c[:3]))

    def _axis(index: int, name: str) -> Any:  # type: ignore[misc]
        def get(self: Any) -> Vector3:
            return Vector3(*self._c[index][:3])

        def put(self: Any, value: Any) -> None:
            self._c[index][:3] = Vector3._of(value)._v

        return property(get, put, doc=f"First three numbers of the column that points {name}.")

    right, up, backward = _axis(0, "right"), _axis(1, "up"), _axis(2, "backward")
    translation = _Both(_translation, property(_get_translation, _set_translation))
    rotation = _Both(_rotation, _get_rotation)
    scaling = _Both(_scaling, _get_scaling)

    # ---- Transforming
    def transform_vector(self, vector: Any) -> Vector3:
        """The vector transformed without translation."""
        v = Vector3._of(vector)._v
        return Vector3(*(sum(self._c[k][r] * v[k] for k in range(3)) for r in range(3)))

    def transform_point(self, point: Any) -> Vector3:
        """The point transformed, divided by its last coordinate."""
        p = (*Vector3._of(point)._v, 1.0)
        x, y, z, w = (sum(self._c[k][r] * p[k] for k in range(4)) for r in range(4))
        return Vector3(x / w, y / w, z / w)

    def is_rigid_transformation(self) -> bool:
        """Whether the matrix is a rotation followed by a translation."""
        try:
            Quaternion.from_matrix(_linear(self))
        except ValueError:
            return False
        return [c[3] for c in self._c] == [0, 0, 0, 1]

    def inverted_rigid(self) -> "Matrix4":
        """The inverse of a rotation followed by a translation. Raises ValueError if it is none."""
        if not self.is_rigid_transformation():
            raise ValueError(f"Matrix4.inverted_rigid: {self!r} is no rigid transformation")
        r = _linear(self).transposed()
        return Matrix4.from_(r, -(r @ self._get_translation()))


def _cross(a: Vector3, b: Vector3) -> Vector3:
    return Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
