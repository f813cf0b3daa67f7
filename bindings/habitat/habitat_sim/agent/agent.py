# SPDX-License-Identifier: Apache-2.0
"""Agents: a body with sensors and actions."""

import dataclasses
from typing import Any

import numpy as np

import gsnav_habitat as _shared
from magnum import Quaternion

from .. import errors
from ..scene import SceneNode, _unit
from ..sensor import CameraSensorSpec, SensorFactory
from ..utils.common import quat_from_coeffs, quat_from_magnum
from .controls import ActionSpec, ActuationSpec, ObjectControls


def _identity() -> Any:
    import quaternion

    return quaternion.quaternion(1, 0, 0, 0)


class _Pose:
    """A position, float32 [3] in metres, and a rotation, a quaternion of numpy-quaternion. A rotation can be assigned
    as four numbers x, y, z, w."""

    def __init__(self, position: Any = None, rotation: Any = None) -> None:
        self.position = np.zeros(3, np.float32) if position is None else position
        self.rotation = _identity() if rotation is None else rotation

    @classmethod
    def _of_node(cls, node: SceneNode) -> Any:
        """The pose of a node in the world."""
        position, rotation = node._in_world()
        made = cls.__new__(cls)
        # Habitat-Lab asks for poses several times per step: the values need no conversion.
        made.__dict__.update(position=np.array(position._v), rotation=quat_from_magnum(rotation))
        return made

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "position":
            value = np.array(value, dtype=np.float32)
        elif name == "rotation":
            if not hasattr(value, "components") and not isinstance(value, Quaternion):
                value = quat_from_coeffs(np.asarray(value, dtype=np.float64))
        elif name[0] != "_" and type(self).__module__ == __name__ and (
            name != "sensor_states" or not isinstance(self, AgentState)
        ):
            raise _shared.NotServed(self._unserved(name))
        object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        if name[0] == "_":
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise _shared.NotServed(self._unserved(name))

    @classmethod
    def _unserved(cls, name: str) -> str:
        return _shared.message(f"habitat_sim.agent.{cls.__name__}.{name}")

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        mine, theirs = self.__dict__, other.__dict__
        return np.array_equal(mine["position"], theirs["position"]) and all(
            mine[k] == theirs[k] for k in mine if k != "position"
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.__dict__.items())})"


class SixDOFPose(_Pose):
    """Pose of a sensor in the world."""


class AgentState(_Pose):
    """Pose of an agent in the world, with those of its sensors by their names."""

    def __init__(self, position: Any = None, rotation: Any = None, sensor_states: Any = None) -> None:
        super().__init__(position, rotation)
        self.sensor_states: dict[str, SixDOFPose] = {} if sensor_states is None else dict(sensor_states)


def _default_actions() -> dict[Any, ActionSpec]:
    return {
        "move_forward": ActionSpec("move_forward", ActuationSpec(amount=0.25)),
        "turn_left": ActionSpec("turn_left", ActuationSpec(amount=10.0)),
        "turn_right": ActionSpec("turn_right", ActuationSpec(amount=10.0)),
    }


@dataclasses.dataclass
class AgentConfiguration(_shared.FullySealed):
    """Settings of an agent. Lengths in metres."""

    height: float = 1.5
    radius: float = 0.1
    sensor_specifications: list[Any] = dataclasses.field(default_factory=lambda: [CameraSensorSpec()])
    action_space: dict[Any, ActionSpec] = dataclasses.field(default_factory=_default_actions)
    body_type: str = "cylinder"


class Agent(_shared.FullySealed):
    """A body on a node, with sensors on nodes below."""

    def __init__(
        self, scene_node: SceneNode, agent_config: Any = None, sensors: Any = None, controls: Any = None
    ) -> None:
        self.body = scene_node
        self.controls = ObjectControls() if controls is None else controls
        self.initial_state: Any = None
        self.reconfigure(AgentConfiguration() if agent_config is None else agent_config)

    @property
    def scene_node(self) -> SceneNode:
        """Node of the body."""
        return self.body

    @property
    def sensors(self) -> dict[str, Any]:
        """Sensors on the body and below, by their names."""
        return self.body.subtree_sensors

    _sensors = sensors

    def reconfigure(self, agent_config: Any, reconfigure_sensors: bool = True) -> None:
        """Replaces the settings and, unless told otherwise, makes the sensors anew."""
        self.agent_config = agent_config
        if not reconfigure_sensors:
            return
        for sensor in self.sensors.values():
            SensorFactory.delete_sensor(sensor)
        SensorFactory.create_sensors(self.body, agent_config.sensor_specifications)

    def _action(self, action_id: Any) -> ActionSpec:
        """An action that can be performed, by its name. Raises the errors of `act`."""
        space = self.agent_config.action_space
        assert action_id in space, f"no action {action_id!r}; the actions are {list(space)}"
        action: ActionSpec = space[action_id]
        if isinstance(action.actuation, ActuationSpec):
            action.actuation._check(action.name)
        return action

    def act(self, action_id: Any) -> bool:
        """Performs an action of the action space. Returns whether the body moved less far than it tried to.
        Raises AssertionError for an unknown action, ValueError for an actuation that is not finite."""
        action = self._action(action_id)
        if action.name == "stop" and action.actuation is None:
            return False
        if self.controls.is_body_action(action.name):
            return self.controls.action(self.body, action.name, action.actuation, apply_filter=True)
        for sensor in self.sensors.values():
            self.controls.action(sensor.node, action.name, action.actuation, apply_filter=False)
        return False

    def get_state(self) -> AgentState:
        """Pose of the body and the sensors in the world."""
        state: AgentState = AgentState._of_node(self.body)
        state.sensor_states = {uuid: SixDOFPose._of_node(s.node) for uuid, s in self.sensors.items()}
        return state

    def set_state(
        self, state: AgentState, reset_sensors: bool = True, infer_sensor_states: bool = True, is_initial: bool = False
    ) -> None:
        """Moves the body to any pose.

        The sensors keep their poses relative to the body, or take those of their specifications if `reset_sensors`
        is set. Without `infer_sensor_states`, those named in `state.sensor_states` then take the poses given there.
        Raises ValueError for a pose that is not finite, and for a rotation of length 0.
        """
        for pose in (state, *state.sensor_states.values()):
            what = f"set_state: {type(pose).__name__}"
            _unit(pose.rotation, f"{what}.rotation")
            if pose.position.shape != (3,):
                raise ValueError(f"{what}.position = {pose.position}: must be three numbers")
            if not np.isfinite(pose.position).all():
                raise ValueError(f"{what}.position = {pose.position}: is not finite")
        self.body._place(state.position, Quaternion._of(state.rotation).normalized())
        for uuid, sensor in self.sensors.items():
            if reset_sensors:
                sensor.set_transformation_from_spec()
            if not infer_sensor_states and uuid in state.sensor_states:
                pose = state.sensor_states[uuid]
                sensor.node._place(pose.position, Quaternion._of(pose.rotation).normalized())
        if is_initial:
            self.initial_state = self.get_state()

    @property
    def state(self) -> AgentState:
        """Pose of the body and the sensors in the world, a copy."""
        return self.get_state()

    @state.setter
    def state(self, value: AgentState) -> None:
        self.set_state(value, reset_sensors=True, infer_sensor_states=True, is_initial=False)

    def close(self) -> None:
        """Does nothing: memory is freed with the agent."""


__all__ = ["Agent", "AgentConfiguration", "AgentState", "SixDOFPose", "errors"]
