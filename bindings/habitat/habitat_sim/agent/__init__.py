# SPDX-License-Identifier: Apache-2.0
"""Agents and their actions."""

from . import controls
from .agent import Agent, AgentConfiguration, AgentState, SixDOFPose
from .controls import ActionSpec, ActuationSpec, ObjectControls, PyRobotNoisyActuationSpec, SceneNodeControl

__all__ = ["ActionSpec", "ActuationSpec", "Agent", "AgentConfiguration", "AgentState", "ObjectControls",
           "PyRobotNoisyActuationSpec", "SceneNodeControl", "SixDOFPose", "controls"]  # fmt: skip
