# SPDX-License-Identifier: Apache-2.0
"""Vectors, matrices, quaternions, ranges, angles and colours, for scripts of habitat-lab on gsnav.

The distribution gsnav-habitat provides this package. It is a small part of the names of Magnum's Python module.
"""

import gsnav_habitat as _shared

_shared.claim()

from . import math, trade  # noqa: E402
from ._angle import Deg, Rad  # noqa: E402
from ._color import Color3, Color4  # noqa: E402
from ._matrix import Matrix3, Matrix4  # noqa: E402
from ._quaternion import Quaternion  # noqa: E402
from ._range import Range1D, Range2D, Range3D  # noqa: E402
from ._vector import Vector2, Vector3, Vector4  # noqa: E402

__gsnav__ = True
for _name in ("ImageView2D", "MutableImageView2D", "PixelFormat", "PixelStorage", "MeshPrimitive"):
    globals()[_name] = _shared.unserved("magnum", _name)

_shared.unserved_members(Matrix4, "orthographic_projection", "reflection", "shearing_xy")
_shared.unserved_members(Quaternion, "reflection", "reflect_vector", "to_euler")
_shared.unserved_members(Color3, "to_hsv", "from_xyz", "to_xyz", "hue", "saturation", "value")
_shared.unserved_members(Color4, "to_hsv", "from_xyz", "to_xyz", "hue", "saturation", "value")
_shared.unserved_members(Range3D, "x", "y", "z", "xy")
_shared.unserved_members(Range2D, "x", "y")

_shared.complete(__name__)
__all__ = ["Color3", "Color4", "Deg", "Matrix3", "Matrix4", "Quaternion", "Rad", "Range1D", "Range2D", "Range3D",
           "Vector2", "Vector3", "Vector4", "math", "trade"]  # fmt: skip
