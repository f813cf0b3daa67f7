# SPDX-License-Identifier: Apache-2.0
"""Quaternions of numpy-quaternion (w x y z), of magnum, and as four numbers x y z w."""

import math
from typing import Any

import numpy as np

from magnum import Quaternion, Vector3


def _make(w: float, x: float, y: float, z: float) -> Any:
    import quaternion

    return quaternion.quaternion(w, x, y, z)


def quat_from_coeffs(coeffs: Any) -> Any:
    """Quaternion of the numbers x, y, z, w."""
    x, y, z, w = (float(c) for c in coeffs)
    return _make(w, x, y, z)


def quat_to_coeffs(quat: Any) -> np.ndarray:
    """The numbers x, y, z, w."""
    return np.array([quat.x, quat.y, quat.z, quat.w])


def quat_to_magnum(quat: Any) -> Quaternion:
    """Converts a numpy quaternion to a magnum.Quaternion."""
    return Quaternion(Vector3(quat.x, quat.y, quat.z), quat.w)


def quat_from_magnum(quat: Quaternion) -> Any:
    """The same rotation in numpy-quaternion."""
    x, y, z, w = quat._q
    return _make(w, x, y, z)


def quat_to_angle_axis(quat: Any) -> tuple[float, np.ndarray]:
    """Angle in radians, 0 to 2 pi, and axis. No rotation has the axis x."""
    sine = math.sqrt(quat.x**2 + quat.y**2 + quat.z**2)
    angle = 2 * math.atan2(sine, quat.w)
    if sine < 1e-10:
        return angle, np.array([1.0, 0.0, 0.0])
    return angle, np.array([quat.x, quat.y, quat.z]) / sine


def quat_from_angle_axis(theta: float, axis: Any) -> Any:
    """Rotation by radians about an axis of any length but 0."""
    axis = np.asarray(axis, dtype=np.float64)
    x, y, z = axis / np.linalg.norm(axis) * math.sin(theta / 2)
    return _make(math.cos(theta / 2), x, y, z)


def quat_from_two_vectors(v0: Any, v1: Any) -> Any:
    """Shortest rotation of the direction v0 to the direction v1."""
    a = np.asarray(v0, dtype=np.float64) / np.linalg.norm(v0)
    b = np.asarray(v1, dtype=np.float64) / np.linalg.norm(v1)
    half = a + b
    if np.linalg.norm(half) < 1e-6:  # Opposite: half a turn about any axis at right angles.
        axis = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        return quat_from_angle_axis(math.pi, axis)
    half /= np.linalg.norm(half)
    x, y, z = np.cross(a, half)
    return _make(float(a @ half), x, y, z)


def angle_between_quats(q1: Any, q2: Any) -> float:
    """Angle of the rotation between two quaternions, radians, 0 to pi."""
    if isinstance(q1, Quaternion) or isinstance(q2, Quaternion):
        d = Quaternion._of(q1).inverted() * q2
        sine, cosine = d.vector.length(), d.scalar
    else:
        d = q1.inverse() * q2
        sine, cosine = math.sqrt(d.x**2 + d.y**2 + d.z**2), d.w
    return 2 * math.atan2(sine, abs(cosine))


def quat_rotate_vector(q: Any, v: Any) -> np.ndarray:
    """The vector rotated by a quaternion of numpy-quaternion."""
    vq = _make(0, *(float(x) for x in v))
    return (q * vq * q.inverse()).imag


def random_quaternion() -> Quaternion:
    """Rotation that is uniform over all rotations, from numpy's random numbers."""
    v = np.random.normal(size=4)
    x, y, z, w = v / np.linalg.norm(v)
    return Quaternion(Vector3(x, y, z), w)
