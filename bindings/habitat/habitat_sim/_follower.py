# SPDX-License-Identifier: Apache-2.0
"""The greedy follower."""

import math
from typing import Any

import numpy as np

import gsnav_habitat as _shared

from . import _engine, errors


class GreedyGeodesicFollower(_shared.FullySealed):
    """Policy that follows the shortest path with an agent's own actions.

    `next_action_along(goal)` returns one of the four keys; `find_path(goal)` all of them, the stop key last.
    """

    def __init__(
        self,
        pathfinder: Any,
        agent: Any,
        goal_radius: float | None = None,
        *,
        stop_key: Any = None,
        forward_key: Any = None,
        left_key: Any = None,
        right_key: Any = None,
        fix_thrashing: bool = True,
        thrashing_threshold: int = 16,
    ) -> None:
        """`goal_radius` in metres; by default three quarters of a step. Keys are found by the names move_forward,
        turn_left and turn_right of the agent's actions; the stop key is None by default."""
        from .nav import GreedyFollowerCodes

        self.pathfinder, self.agent = pathfinder, agent
        self.forward_spec = self._spec("move_forward", forward_key)
        self.left_spec = self._spec("turn_left", left_key)
        self.right_spec = self._spec("turn_right", right_key)
        self.goal_radius = 0.75 * self.forward_spec.amount if goal_radius is None else float(goal_radius)
        self.action_mapping = {
            GreedyFollowerCodes.STOP: stop_key,
            GreedyFollowerCodes.FORWARD: self._key("move_forward", forward_key),
            GreedyFollowerCodes.LEFT: self._key("turn_left", left_key),
            GreedyFollowerCodes.RIGHT: self._key("turn_right", right_key),
        }
        self.last_goal: Any = None
        self._follower: Any = None
        self._mesh: Any = None
        # A plan that touches no wall also holds for agents that slide.
        self._allow_sliding = False

    def _key(self, name: str, key: Any) -> Any:
        if key is not None:
            return key
        for candidate, spec in self.agent.agent_config.action_space.items():
            if spec.name == name:
                return candidate
        raise errors.GreedyFollowerError(f"the agent has no action {name}, and no key was given")

    def _spec(self, name: str, key: Any) -> Any:
        space = self.agent.agent_config.action_space
        if key in space:
            return space[key].actuation
        for spec in space.values():
            if spec.name == name:
                return spec.actuation
        raise errors.GreedyFollowerError(f"the agent has no action {name}")

    def reset(self) -> None:
        """Forgets the goal and the actions so far."""
        self.last_goal, self._follower = None, None

    def _build(self, goal: Any) -> None:
        gsnav = _engine.library()
        goal = np.array([float(x) for x in goal], dtype=np.float32)
        mesh = self.pathfinder._need("find_path")
        same = self.last_goal is not None and np.allclose(goal, self.last_goal) and mesh is self._mesh
        if same and self._follower is not None:
            return
        task = gsnav.TaskConfig(
            forward_step=float(self.forward_spec.amount),
            turn_angle=float(self.left_spec.amount),
            allow_sliding=self._allow_sliding,
        )
        self.last_goal, self._mesh = goal, mesh
        at = self.pathfinder.snap_point(goal)
        self._follower = gsnav.GreedyGeodesicFollower(mesh, list(at), task, self.goal_radius)

    def _code(self, position: Any, yaw: float) -> Any:
        from .nav import GreedyFollowerCodes as Codes

        gsnav = _engine.library()
        try:
            at = self.pathfinder.snap_point(position)
            action = self._follower.next(list(at), yaw)
        except gsnav.Error as error:
            raise errors.GreedyFollowerError(str(error)) from error
        return {
            gsnav.Action.stop: Codes.STOP,
            gsnav.Action.move_forward: Codes.FORWARD,
            gsnav.Action.turn_left: Codes.LEFT,
            gsnav.Action.turn_right: Codes.RIGHT,
        }[action]

    def next_action_along(self, goal_pos: Any) -> Any:
        """Key of the next action towards a point, or the stop key within the goal radius.

        Raises habitat_sim.errors.GreedyFollowerError if the goal cannot be reached.
        """
        try:
            self._build(goal_pos)
        except _engine.library().Error as error:
            raise errors.GreedyFollowerError(str(error)) from error
        state = self.agent.state
        return self.action_mapping[self._code(state.position, _yaw(state.rotation))]

    def find_path(self, goal_pos: Any) -> list[Any]:
        """All keys from the agent's pose to a point, the stop key last. Raises GreedyFollowerError."""
        from .nav import GreedyFollowerCodes as Codes

        self.reset()
        try:
            self._build(goal_pos)
        except _engine.library().Error as error:
            raise errors.GreedyFollowerError(str(error)) from error
        state = self.agent.state
        position, yaw, keys = state.position, _yaw(state.rotation), []
        step, turn = float(self.forward_spec.amount), math.radians(float(self.left_spec.amount))
        for _ in range(5000):
            code = self._code(position, yaw)
            keys.append(self.action_mapping[code])
            if code == Codes.STOP:
                return keys
            if code == Codes.FORWARD:
                end = [position[0] - step * math.sin(yaw), position[1], position[2] - step * math.cos(yaw)]
                position = self.agent.controls.move_filter_fn(position, end)
            yaw += {Codes.LEFT: turn, Codes.RIGHT: -turn}.get(code, 0.0)
        raise errors.GreedyFollowerError(f"5000 actions do not lead to {self.last_goal}")


def _yaw(rotation: Any) -> float:
    """Heading of a quaternion about +Y, radians; 0 is -Z."""
    w, x, y, z = rotation.w, rotation.x, rotation.y, rotation.z
    return math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y))
