# SPDX-License-Identifier: Apache-2.0
"""Actions and their specifications."""

from . import default_controls  # noqa: F401
from .controls import ActionSpec, ActuationSpec, ObjectControls, PyRobotNoisyActuationSpec, SceneNodeControl

__all__ = ["ActionSpec", "ActuationSpec", "ObjectControls", "PyRobotNoisyActuationSpec", "SceneNodeControl"]
