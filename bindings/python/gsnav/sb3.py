# SPDX-License-Identifier: Apache-2.0
"""Trains with Stable-Baselines3, which has vector environments of its own. It needs stable-baselines3.

    model = PPO("MultiInputPolicy", gsnav.sb3.VecEnv(gsnav.VectorEnv(16, autoreset_mode="SameStep")))
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv as BaseVecEnv

from . import _task
from ._errors import InvalidArgument
from ._vector_env import VectorEnv

__all__ = ["VecEnv"]


class VecEnv(BaseVecEnv):  # type: ignore[misc, unused-ignore]  # without stable-baselines3 it is unknown
    """A VectorEnv as a `VecEnv` of Stable-Baselines3.

    Infos have the outcome of each action, and at the end of an episode "terminal_observation", "metrics",
    "TimeLimit.truncated" and "episode" with the reward "r" and the number of steps "l".
    """

    def __init__(self, envs: VectorEnv) -> None:
        """Wraps `envs`, whose autoreset mode must be SAME_STEP."""
        if getattr(envs.metadata["autoreset_mode"], "value", None) != "SameStep":
            raise InvalidArgument("sb3.VecEnv: create the VectorEnv with autoreset_mode=\"SameStep\"")
        self.envs = envs
        self._actions: Any = None
        self._returns = np.zeros(envs.num_envs)
        self._steps = np.zeros(envs.num_envs, np.int64)
        self._seed: int | None = None
        self.render_mode = envs.render_mode
        spaces: Any = envs  # Their types are those of Gymnasium, where it is installed.
        super().__init__(envs.num_envs, spaces.single_observation_space, spaces.single_action_space)

    def reset(self) -> Any:
        """Starts an episode in each environment. Returns the observations."""
        observations, infos = self.envs.reset(seed=self._seed)
        self._seed = None
        self.reset_infos = [self._info(infos, e) for e in range(self.num_envs)]
        self._returns[:] = self._steps[:] = 0
        return observations

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds the next reset: environment e gets seed + e."""
        self._seed = seed
        return [None if seed is None else seed + e for e in range(self.num_envs)]

    def step_async(self, actions: Any) -> None:
        """Stores the actions, integers [N]."""
        self._actions = actions

    def step_wait(self) -> Any:
        """Performs the stored actions. Returns observations, rewards, dones and infos."""
        observations, rewards, terminated, truncated, infos = self.envs.step(self._actions)
        dones = terminated | truncated
        self._returns += rewards
        self._steps += 1
        outcomes = [self._info(infos["final_info"] if dones[e] else infos, e) for e in range(self.num_envs)]
        for e in np.flatnonzero(dones):
            outcomes[e]["terminal_observation"] = infos["final_obs"][e]
            outcomes[e]["TimeLimit.truncated"] = bool(truncated[e])
            outcomes[e]["metrics"] = {k: infos["final_info"]["metrics"][k][e] for k in _task.METRIC_FIELDS}
            outcomes[e]["episode"] = {"r": float(self._returns[e]), "l": int(self._steps[e])}
        self._returns[dones], self._steps[dones] = 0, 0
        return observations, rewards.astype(np.float32), dones, outcomes

    def close(self) -> None:
        """Closes the environments."""
        self.envs.close()

    def get_images(self) -> Sequence[Any]:
        """The last image of each environment."""
        return self.envs.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the VectorEnv, once per environment."""
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Environments have no attributes of their own."""
        raise NotImplementedError("sb3.VecEnv.set_attr: the environments are one object; set its attributes")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Environments have no methods of their own."""
        raise NotImplementedError("sb3.VecEnv.env_method: the environments are one object; call its methods")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """False for each environment."""
        return [False] * len(list(self._get_indices(indices)))

    @staticmethod
    def _info(infos: dict[str, Any], e: int) -> dict[str, Any]:
        return {name: infos[name][e] for name in _task.INFO_FIELDS}
