# SPDX-License-Identifier: Apache-2.0
"""The actions that are registered under Habitat's names."""

from typing import Any, Callable

import numpy as np

from magnum import Deg, Vector3

from ...registry import registry
from .controls import SceneNodeControl


def _mover(name: str, axis: tuple[int, int, int], body: bool) -> None:
    direction = Vector3(*axis)

    def call(self: Any, scene_node: Any, actuation_spec: Any) -> None:
        scene_node.translate_local(direction * actuation_spec.amount)

    _register(name, call, body)


def _turner(name: str, axis: tuple[int, int, int], sign: int, body: bool, limited: bool = False) -> None:
    direction = Vector3(*axis)

    def call(self: Any, scene_node: Any, actuation_spec: Any) -> None:
        angle = sign * actuation_spec.amount
        limit = actuation_spec.constraint
        if limited and limit is not None:
            q = scene_node.rotation
            now = float(np.degrees(2 * np.arctan2(q.vector.dot(direction), q.scalar)))
            now = (now + 180) % 360 - 180
            angle = min(max(now + angle, -limit), limit) - now
        scene_node.rotate_local(Deg(angle), direction)

    _register(name, call, body)


def _register(name: str, call: Callable[..., None], body: bool) -> None:
    kind = type("".join(w.title() for w in name.split("_")), (SceneNodeControl,), {"__call__": call})
    registry.register_move_fn(kind, name=name, body_action=body)


def _register_all() -> None:
    _mover("move_forward", (0, 0, -1), True)
    _mover("move_backward", (0, 0, 1), True)
    _mover("move_left", (-1, 0, 0), True)
    _mover("move_right", (1, 0, 0), True)
    _turner("turn_left", (0, 1, 0), 1, True)
    _turner("turn_right", (0, 1, 0), -1, True)
    _mover("move_up", (0, 1, 0), False)
    _mover("move_down", (0, -1, 0), False)
    _turner("look_left", (0, 1, 0), 1, False, limited=True)
    _turner("look_right", (0, 1, 0), -1, False, limited=True)
    _turner("look_up", (1, 0, 0), 1, False, limited=True)
    _turner("look_down", (1, 0, 0), -1, False, limited=True)
    _turner("rotate_sensor_anti_clockwise", (0, 0, 1), 1, False)
    _turner("rotate_sensor_clockwise", (0, 0, 1), -1, False)


_register_all()
