# SPDX-License-Identifier: Apache-2.0
"""Actions that move an agent or its sensors."""

import dataclasses
import numbers
from typing import Any, Callable

import gsnav_habitat as _shared
from magnum import Deg, Rad, Vector3

from ...registry import registry


@dataclasses.dataclass
class ActuationSpec(_shared.FullySealed):
    """Size of an action: metres or degrees. `constraint` limits a tilt to +-degrees, or is None."""

    amount: float
    constraint: float | None = None

    def _check(self, action_name: str) -> None:
        """Raises ValueError naming a field that is beyond 1e9 or not finite."""
        for name, value in (("amount", self.amount), ("constraint", self.constraint)):
            if isinstance(value, (numbers.Real, Deg, Rad)) and not abs(float(value)) <= 1e9:
                raise ValueError(
                    f"action {action_name!r}: ActuationSpec.{name} = {value}: must be finite and at most 1e9"
                )


@dataclasses.dataclass
class ActionSpec(_shared.FullySealed):
    """An action: the name of a registered function, and the actuation that it gets."""

    name: str
    actuation: Any = None


PyRobotNoisyActuationSpec = _shared.unserved("habitat_sim.agent", "PyRobotNoisyActuationSpec")


class SceneNodeControl:
    """Base of actions. A subclass defines __call__(scene_node, actuation_spec)."""

    def __init__(self, body_action: bool) -> None:
        self.body_action = body_action

    def __call__(self, scene_node: Any, actuation_spec: Any) -> None:
        raise NotImplementedError(f"{type(self).__name__} does not define __call__")


class ObjectControls(_shared.FullySealed):
    """Performs actions. `move_filter_fn(start, end)` returns the position that a move of a body reaches."""

    def __init__(self) -> None:
        self.move_filter_fn: Callable[[Any, Any], Any] = lambda start, end: end

    @staticmethod
    def is_body_action(action_name: str) -> bool:
        """Whether an action moves the agent. Raises AssertionError for an unknown name."""
        move = registry.get_move_fn(action_name)
        assert move is not None, f"there is no action {action_name!r}"
        return move.body_action

    def action(self, obj: Any, action_name: str, actuation_spec: Any, apply_filter: bool = True) -> bool:
        """Performs an action on a node. Returns whether it moved less far than was asked for: the squared
        lengths differ by more than 1e-5. Raises ValueError for an actuation that is not finite."""
        if isinstance(actuation_spec, ActuationSpec):
            actuation_spec._check(action_name)
        move = registry.get_move_fn(action_name)
        assert move is not None, f"there is no action {action_name!r}"
        start = obj.absolute_translation
        move(obj, actuation_spec)
        if not apply_filter:
            return False
        end = obj.absolute_translation
        reached = Vector3._of(self.move_filter_fn(start, end))
        obj.translate(reached - end)
        return (reached - start).dot() + 1e-5 < (end - start).dot()
