# SPDX-License-Identifier: Apache-2.0
"""Registry of actions, noise models and pose extractors by name."""

import collections
import re
from typing import Any

import gsnav_habitat as _shared


def _camel_to_snake(name: str) -> str:
    split = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", split).lower()


class _Registry(_shared.FullySealed):
    """Names by kind."""

    _mapping: dict[str, dict[str, Any]] = collections.defaultdict(dict)

    @classmethod
    def _register(cls, kind: str, value: Any, name: str) -> Any:
        cls._mapping[kind][name] = value
        return value

    @classmethod
    def register_move_fn(
        cls, controller: Any = None, *, name: str | None = None, body_action: bool | None = None
    ) -> Any:
        """Registers a class of actions, as a decorator or with its arguments. `body_action` is required: True if
        the action moves the agent, False if it moves its sensors. The name is that of the class by default."""
        if body_action is None:
            raise AssertionError("register_move_fn: body_action must be given")

        def register(kind: Any) -> Any:
            from .agent.controls.controls import SceneNodeControl

            if not (isinstance(kind, type) and issubclass(kind, SceneNodeControl)):
                raise AssertionError(f"register_move_fn: {kind!r} is no subclass of SceneNodeControl")
            key = _camel_to_snake(kind.__name__) if name is None else name
            return cls._register("move_fn", kind(body_action), key) and kind

        return register if controller is None else register(controller)

    @classmethod
    def register_noise_model(cls, noise_model: Any = None, *, name: str | None = None) -> Any:
        """Registers a class of sensor noise, as a decorator or with its arguments."""

        def register(kind: Any) -> Any:
            return cls._register("noise_model", kind, kind.__name__ if name is None else name)

        return register if noise_model is None else register(noise_model)

    @classmethod
    def register_pose_extractor(cls, pose_extractor: Any = None, *, name: str | None = None) -> Any:
        """Registers a class that extracts poses, as a decorator or with its arguments."""

        def register(kind: Any) -> Any:
            return cls._register("pose_extractor", kind, kind.__name__ if name is None else name)

        return register if pose_extractor is None else register(pose_extractor)

    @classmethod
    def _get_impl(cls, kind: str, name: str) -> Any:
        return cls._mapping[kind].get(name)

    @classmethod
    def get_move_fn(cls, name: str) -> Any:
        """The action of a name, or None."""
        return cls._get_impl("move_fn", name)

    @classmethod
    def get_noise_model(cls, name: str) -> Any:
        """The noise model of a name, or None."""
        return cls._get_impl("noise_model", name)

    @classmethod
    def get_pose_extractor(cls, name: str) -> Any:
        """The pose extractor of a name, or None."""
        return cls._get_impl("pose_extractor", name)


registry = _Registry()
