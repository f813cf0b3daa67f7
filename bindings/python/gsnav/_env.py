# SPDX-License-Identifier: Apache-2.0
"""Env: one PointNav environment."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _task
from ._call_errors import short
from ._errors import ClosedEnvironment, InvalidArgument
from ._gsnav import (
    Device,
    EpisodeRules,
    Observations,
    PointNavEpisode,
    Simulator,
    SimulatorConfig,
    copy_image,
    to_bytes,
)
from ._spaces import HAVE_GYMNASIUM, BaseEnv

Observation = dict[str, npt.NDArray[np.float32]]


class Env(BaseEnv):
    """PointNav environment with one agent: a `gymnasium.Env`, or the same shape without Gymnasium.

    An observation is a dict. It has an image per sensor, float32 [H][W][C], and "point_goal", float32 [2]: the
    distance (metres, on the ground plane) and the angle (radians to the left). Observations are new arrays,
    whose images are aligned to 64 bytes.

    Actions are 0 (stop), 1 (forward), 2 (turn left) and 3 (turn right). An episode is terminated by `stop`, and
    truncated after `config.task.max_steps` actions. The info of the last step has "metrics".
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 4}

    def __init__(self, scene: _task.Scene = "default", *, device: Device | str = "best",
                 config: SimulatorConfig | None = None, episodes: Sequence[_task.Episode] | None = None,
                 rules: EpisodeRules | None = None, render_mode: str | None = None) -> None:
        """Creates an environment.

        scene: a name or path for open_scene, an OpenedScene or a SimulatorScene. It needs a NavMesh; one is built for a
            name that has none.
        device: device that simulates and renders, or its name.
        config: agent, task and sensors. Default: RGB and depth of 256 x 256 pixels.
        episodes: episodes to draw from. Default: they are sampled by `rules`.
        render_mode: None, or "rgb_array" for the image of the first RGB sensor in 8 bit.
        """
        config = _task.settings(config)
        _task.checked(device, (Device, str), "device")
        with _task.memory_for_spaces(config, 1):
            self.observation_space = _task.observation_space(config)
        self.action_space = _task.action_space()
        self._rgb = _task.rgb_sensor(config, render_mode)
        self.render_mode = render_mode
        if not self._rgb:
            self.metadata = {**self.metadata, "render_modes": []}
        self.scene = _task.scene_of(scene, config)
        self._episodes = _task.Episodes([self.scene], episodes, rules)
        self._simulator: Simulator | None = Simulator(device, self.scene, config)
        self._last: npt.NDArray[np.float32] | None = None  # for `render`
        if HAVE_GYMNASIUM:
            from ._registration import spec
            # The scene as it was given: a name can be pickled. The others are copies.
            self.spec = spec({"scene": scene, "device": device, "config": copy.copy(config),
                              "episodes": self._episodes.given, "rules": copy.copy(rules),
                              "render_mode": render_mode})

    @property
    def simulator(self) -> Simulator:
        """The simulator. Calls that change it do not update the environment's last observation."""
        if self._simulator is None:
            raise ClosedEnvironment("Env: the environment is closed; create a new one")
        return self._simulator

    def reset(self, *, seed: int | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Starts the next episode, or `options["episode"]`.

        The same seed gives the same sequence of episodes. A reset that raises an exception changes nothing.
        """
        simulator, episode = self.simulator, _task.option(options, "episode")
        if episode is not None and not isinstance(episode, PointNavEpisode):
            raise TypeError(f"options[\"episode\"]: expected a PointNavEpisode, got {type(episode).__name__}")
        seed, before = _task.checked_seed(seed), simulator.state()
        with _task.undone_if_it_fails(self, []):
            super().reset(seed=seed)
            try:
                seen = simulator.reset(self._episodes.draw(self.np_random).episode if episode is None else episode)
            except BaseException:
                simulator.set_state(before)
                raise
        return self._observation(seen), _task.info_dict(seen.info)

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Performs one action: an integer, or an array without dimensions of any library, by DLPack.

        Returns observation, reward, terminated, truncated and info.
        """
        simulator = self.simulator
        action = _task.from_dlpack(action, "Env.step: action")
        if isinstance(action, (bool, np.bool_)) or action not in self.action_space:
            raise InvalidArgument(f"Env.step: action {short(action)}: use an integer from 0 (stop) to 3 (turn right)")
        seen = simulator.step(int(action))
        info = _task.info_dict(seen.info)
        terminated = truncated = False
        if simulator.done:
            metrics = simulator.metrics()
            terminated = metrics.stop_called
            truncated = not terminated
            info["metrics"] = _task.metrics_dict(metrics)
        return self._observation(seen), seen.reward, terminated, truncated, info

    def render(self) -> npt.NDArray[np.uint8] | None:
        """The last image of the first RGB sensor, uint8 [H][W][3]. None without a render mode."""
        if self.render_mode is None:
            return None
        if self._last is None:
            raise InvalidArgument("Env.render: call reset() first")
        return to_bytes(self._last)

    def close(self) -> None:
        """Frees the simulator. Observations stay valid. Closing twice is allowed."""
        self._simulator = None
        self._last = None

    def _observation(self, seen: Observations) -> Observation:
        made = {name: copy_image(image) for name, image in seen.images.items()}
        goal = seen.point_goal
        made[_task.POINT_GOAL] = np.array([goal.distance, goal.angle], np.float32)
        if self.render_mode is not None:
            self._last = copy_image(seen.images[self._rgb])  # The caller may change the one that it gets.
        return made
