# SPDX-License-Identifier: Apache-2.0
"""Quaternions, and colours of ids."""

import colorsys
from typing import Any

import numpy as np

import gsnav_habitat as _shared

from .quaternion_utils import (
    angle_between_quats,
    quat_from_angle_axis,
    quat_from_coeffs,
    quat_from_magnum,
    quat_from_two_vectors,
    quat_rotate_vector,
    quat_to_angle_axis,
    quat_to_coeffs,
    quat_to_magnum,
    random_quaternion,
)

orthonormalize_rotation_shear = _shared.unserved("habitat_sim.utils.common", "orthonormalize_rotation_shear")


def _palette(count: int) -> Any:
    """Colours of distinct hues, uint8 [count][3]. Neighbours differ by the golden angle."""
    rows = [
        colorsys.hsv_to_rgb(i * 0.6180339887498949 % 1.0, (0.55, 0.8)[i % 2], (0.95, 0.75, 0.55)[i % 3])
        for i in range(count)
    ]
    return np.array(np.round(255 * np.array(rows)), dtype=np.uint8)


d3_40_colors_rgb = _palette(40)


def colorize_ids(ids: Any) -> Any:
    """An image of ids in colours, uint8 [height][width][3]. Id -1 is black."""
    ids = np.asarray(ids)
    out = d3_40_colors_rgb[ids.astype(np.int64) % 40]
    out[ids == -1] = 0
    return out


__all__ = ["angle_between_quats", "colorize_ids", "d3_40_colors_rgb", "orthonormalize_rotation_shear",
           "quat_from_angle_axis", "quat_from_coeffs", "quat_from_magnum", "quat_from_two_vectors",
           "quat_rotate_vector", "quat_to_angle_axis", "quat_to_coeffs", "quat_to_magnum",
           "random_quaternion"]  # fmt: skip
