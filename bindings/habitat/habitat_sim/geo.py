# SPDX-License-Identifier: Apache-2.0
"""Directions of an agent's frame: Y is up and -Z is forward. float32 [3], read-only."""

from typing import Any

import numpy as np

import gsnav_habitat as _shared


def _direction(x: float, y: float, z: float) -> Any:
    made = np.array([x, y, z], dtype=np.float32)
    made.flags.writeable = False
    return made


UP, GRAVITY = _direction(0, 1, 0), _direction(0, -1, 0)
FRONT, BACK = _direction(0, 0, -1), _direction(0, 0, 1)
LEFT, RIGHT = _direction(-1, 0, 0), _direction(1, 0, 0)

Ray = _shared.unserved("habitat_sim.geo", "Ray")
OBB = _shared.unserved("habitat_sim.geo", "OBB")
BBox = _shared.unserved("habitat_sim.geo", "BBox")
