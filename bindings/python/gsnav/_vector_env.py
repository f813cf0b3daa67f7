# SPDX-License-Identifier: Apache-2.0
"""VectorEnv: many PointNav environments in one process, stepped by one call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _task
from ._call_errors import short
from ._errors import ClosedEnvironment, InvalidArgument
from ._gsnav import (
    AutoReset,
    BatchConfig,
    BatchSimulator,
    BatchStep,
    Device,
    DeviceArray,
    EpisodeRules,
    SimulatorConfig,
    to_bytes,
    to_host,
)
from ._spaces import AutoresetMode, BaseVectorEnv, batch_space, make_generator

# An array per sensor: float32 of numpy, or a DeviceArray.
Observation = dict[str, Any]
StepResults = tuple[Observation, npt.NDArray[np.float64], npt.NDArray[np.bool_], npt.NDArray[np.bool_], dict[str, Any]]

BOOLS = {bool, np.bool_}
MARKED_FIELDS = tuple((name, "_" + name) for name in _task.INFO_FIELDS)
ARRAY, ACTIONS = np.ndarray, _task.ACTIONS
VALID = frozenset(range(_task.ACTIONS))
AUTO_RESETS = {"NextStep": AutoReset.next_step, "SameStep": AutoReset.same_step, "Disabled": AutoReset.disabled}


class Source:
    """The function that a BatchSimulator calls for episodes. It does not refer to the environment."""

    def __init__(self, episodes: _task.Episodes | _task.EpisodeSource, environments: int) -> None:
        self.episodes = episodes
        self.generators = [make_generator()[0] for _ in range(environments)]

    def __call__(self, environment: int, count: int) -> _task.Episode:
        """The next episode of an environment."""
        if isinstance(self.episodes, _task.Episodes):
            return self.episodes.draw(self.generators[environment])
        return self.episodes(environment, count)


def batch_config(config: SimulatorConfig, auto_reset: AutoReset) -> BatchConfig:
    """The settings for a batch."""
    state = config.__getstate__()
    state["auto_reset"] = auto_reset
    return BatchConfig(**state)


def checked_mode(mode: Any) -> AutoresetMode:
    """An autoreset mode, given as one of Gymnasium or by its name."""
    try:
        return AutoresetMode(getattr(mode, "value", mode))
    except ValueError as e:
        raise InvalidArgument(f"autoreset_mode = {short(mode)}: use one of {', '.join(AUTO_RESETS)}") from e


class VectorEnv(BaseVectorEnv):
    """N PointNav environments: a `gymnasium.vector.VectorEnv`, or the same shape without Gymnasium.

    An observation is a dict. It has an array per sensor, float32 [N][H][W][C], and "point_goal", float32 [N][2]:
    distances (metres) and angles (radians to the left). Actions are integers [N], as in Env.

    Environment e, reset with seed s, gives the bits of an Env that was reset with seed s + e.
    """

    def __init__(self, num_envs: int = 1, scene: _task.Scene | Sequence[_task.Scene] = "default", *,
                 device: Device | str = "best", config: SimulatorConfig | None = None,
                 episodes: Sequence[_task.Episode] | _task.EpisodeSource | None = None,
                 rules: EpisodeRules | None = None,
                 autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP, copy: bool = True,
                 render_mode: str | None = None) -> None:
        """Creates the environments. They share their scenes.

        scene: as in Env, or a list of scenes, of which each sampled episode takes a random one.
        episodes: episodes to draw from; a BatchEpisode names its scene. Or a function like the `next_episode`
            of BatchSimulator, which decides without seeds. Default: episodes are sampled by `rules`.
        autoreset_mode: what happens to an environment whose episode has ended, as in Gymnasium.
        copy: True returns observations as new arrays, which stay as they are. The simulator draws into them, so
            nothing is copied, except with the mode DISABLED. Their memory is used again when they are dead.
            False returns read-only views of the simulator's memory, which the next call overwrites.
        Other arguments are those of Env. `config` may be a BatchConfig. With `images=ImageMemory.backend` and a GPU,
        images are DeviceArrays: views that torch and JAX take without a copy.
        """
        config = _task.settings(config)
        _task.checked(device, (Device, str), "device")
        _task.checked(copy, bool, "copy")
        mode = checked_mode(autoreset_mode)
        self.metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 4, "autoreset_mode": mode}
        self.num_envs = _task.count(num_envs, "num_envs", 1)
        self.single_action_space = _task.action_space()
        with _task.memory_for_spaces(config, self.num_envs):
            self.single_observation_space = _task.observation_space(config)
            self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._rgb = _task.rgb_sensor(config, render_mode)
        self.render_mode = render_mode
        names: list[Any] = list(scene) if isinstance(scene, (list, tuple)) else [scene]
        if not names:
            raise InvalidArgument("scene: the list is empty")
        self.scenes = [_task.scene_of(one, config) for one in names]
        drawn = episodes if callable(episodes) else _task.Episodes(self.scenes, episodes, rules)
        self._source = Source(drawn, self.num_envs)
        self._same_step = mode == AutoresetMode.SAME_STEP
        self._last: Any = None  # for `render`
        self._copy = copy
        self._all = np.ones(self.num_envs, np.bool_)
        self._all.flags.writeable = False
        # Views of each step, made once: the simulator writes all steps to the same memory.
        self._views: tuple[npt.NDArray[Any], ...] | None = None
        self._results: Any = None  # of the step that runs
        self._ended: list[int] = []  # environments whose episode ended in it
        self._kept: Any = None  # Results that are freed by the next step, while a GPU draws.
        self._finishes = self._same_step or render_mode is not None
        self._simulator: BatchSimulator | None = BatchSimulator(
            device, self.scenes, batch_config(config, AUTO_RESETS[mode.value]), self.num_envs, self._source, copy)

    @property
    def simulator(self) -> BatchSimulator:
        """The batch simulator. Step it by the environment only."""
        if self._simulator is None:
            raise ClosedEnvironment("VectorEnv: the environments are closed; create new ones")
        return self._simulator

    def reset(self, *, seed: int | Sequence[int | None] | None = None,
              options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Starts the next episode in all environments, or in those of `options["reset_mask"]`, bool [N].

        seed: environment e gets seed + e, or seed[e]. The same seeds give the same episodes.

        Wrong arguments raise an exception and change nothing. If the next episode of an environment raises one, the
        generators are as before, and all environments need a reset.
        """
        simulator = self.simulator
        mask = self._mask(_task.option(options, "reset_mask"))
        seeds, generators = self._seeds(seed), self._source.generators
        with _task.undone_if_it_fails(self, generators):
            super().reset(seed=seeds[0])
            for e, one in enumerate(seeds):
                if one is not None and (mask is None or mask[e]):
                    generators[e] = make_generator(one)[0]
            step = simulator.reset(mask)
        infos: dict[str, Any] = {}
        self._add_step_info(infos, step.infos, self._all if mask is None else mask)
        observation = self._observation(step)
        if self.render_mode is not None:
            self._show(observation[self._rgb])
        return observation, infos

    def step(self, actions: Any) -> tuple[Observation, npt.NDArray[np.float64], npt.NDArray[np.bool_],
                                          npt.NDArray[np.bool_], dict[str, Any]]:
        """Performs one action per environment: integers [N], also in an array of another library, by DLPack.

        Returns observations, rewards, terminations, truncations and infos. Wrong actions raise an exception
        before any environment moves.
        """
        # On a GPU, all code outside of _prepare adds to the time of a step. It takes ten times as long as in a loop
        # of its own, because a step uses the caches. So C++ checks actions, and there are few lookups here.
        simulator: Any = self._simulator or self.simulator
        if type(actions) is not ARRAY or not simulator._step_plain(actions, ACTIONS, self._prepare):
            simulator.step(self._checked(actions), self._prepare)
        results: StepResults = self._results
        self._results = None
        if self._finishes:
            self._finish(results)
        return results

    def _prepare(self, step: BatchStep) -> None:
        """Makes the results of a step. It runs while a GPU draws, so that images are not complete."""
        if self._views is None:
            self._views = step.infos, step.point_goals, step.rewards, step.terminated, step.truncated
        rows, _, rewards, terminated, truncated = self._views
        infos: dict[str, Any] = {}
        self._add_step_info(infos, rows, self._all)
        self._ended = step.finished.tolist()
        if self._ended:
            self._add_ends(infos, step)
        others = rewards.copy(), terminated.copy(), truncated.copy(), infos
        self._results = self._observation(step), *others
        self._kept = others if self._copy and step.images else self._results

    def _finish(self, results: Any) -> None:
        """Adds results that need complete images, or the worlds of episodes that have begun."""
        if self.render_mode is not None:
            self._show(results[0][self._rgb])
        if self._same_step:
            self._add_begun(results[4], self._ended)

    def render(self) -> tuple[npt.NDArray[np.uint8], ...] | None:
        """The last image of each environment's first RGB sensor, uint8 [H][W][3]. None without a render mode."""
        if self.render_mode is None:
            return None
        if self._last is None:
            raise InvalidArgument("VectorEnv.render: call reset() first")
        if isinstance(self._last, DeviceArray):
            raise InvalidArgument("VectorEnv.render: images are on the GPU; use images=ImageMemory.host to see them")
        return tuple(to_bytes(self._last))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the simulator. Observations stay valid."""
        self._simulator = self._views = None
        self._last = self._results = self._kept = None

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        many: Any = seed
        if isinstance(seed, (str, bytes)) or not isinstance(seed, (Sequence, np.ndarray)) or (
                isinstance(seed, np.ndarray) and seed.ndim == 0):
            first = _task.checked_seed(seed)
            return [None if first is None else first + e for e in range(self.num_envs)]
        if len(many) != self.num_envs:
            raise InvalidArgument(f"seed: {len(many)} seeds for {self.num_envs} environments")
        return [_task.checked_seed(one, f"seed[{e}]") for e, one in enumerate(many)]

    def _mask(self, mask: Any) -> npt.NDArray[np.bool_] | None:
        if mask is None:
            return None
        mask = _task.from_dlpack(mask, "options[\"reset_mask\"]")
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError("options[\"reset_mask\"]: expected an array of bool")
        if mask.shape != (self.num_envs,):
            raise InvalidArgument(f"options[\"reset_mask\"] has shape {mask.shape}: it must be ({self.num_envs},)")
        if not mask.any():
            raise InvalidArgument("options[\"reset_mask\"] has no True")
        return mask

    def _checked(self, actions: Any) -> npt.NDArray[np.integer[Any]]:
        if isinstance(actions, Sequence) and len(actions) != self.num_envs:  # Before it becomes an array.
            raise InvalidArgument(f"VectorEnv.step: {len(actions)} actions for {self.num_envs} environments")
        array = actions if type(actions) is np.ndarray else self._array(actions)
        if array.dtype.kind not in "iu":
            raise TypeError(f"VectorEnv.step: actions have dtype {array.dtype}: use integers")
        if array.shape != (self.num_envs,):
            raise InvalidArgument(f"VectorEnv.step: actions have shape {array.shape}: it must be ({self.num_envs},)")
        if not VALID.issuperset(array.tolist()):
            e = int(np.argmax((array < 0) | (array >= _task.ACTIONS)))
            raise InvalidArgument(f"VectorEnv.step: environment {e}: action {array[e]}: "
                                  "use 0 (stop) to 3 (turn right)")
        return array

    @staticmethod
    def _array(actions: Any) -> npt.NDArray[Any]:
        if isinstance(actions, (list, tuple)) and not BOOLS.isdisjoint(map(type, actions)):
            raise TypeError(f"VectorEnv.step: actions = {short(actions)}: a bool is no action; use integers")
        if isinstance(actions, np.ma.MaskedArray):
            raise TypeError("VectorEnv.step: actions are a masked array: use an array without a mask")
        try:
            return np.asarray(_task.from_dlpack(to_host(actions), "VectorEnv.step: actions"))
        except ValueError as error:
            raise InvalidArgument(f"VectorEnv.step: actions = {short(actions)}: {error}") from error

    def _observation(self, step: BatchStep) -> Observation:
        made: Observation = {**step.images, **step.on_backend}
        made[_task.POINT_GOAL] = (step.point_goals if self._views is None else self._views[1]).astype(np.float32)
        return made

    def _show(self, image: Any) -> None:
        """Keeps the image that `render` shows. The caller may change an array of its own."""
        if not self._copy or isinstance(image, DeviceArray):
            self._last = image  # A view of the simulator's memory.
            return
        if self._last is None:
            self._last = np.empty_like(image)
        np.copyto(self._last, image)

    @staticmethod
    def _add(infos: dict[str, Any], key: str, values: Any, mask: npt.NDArray[np.bool_]) -> None:
        infos[key], infos["_" + key] = values, mask.copy()

    def _add_step_info(self, infos: dict[str, Any], rows: Any, mask: npt.NDArray[np.bool_]) -> None:
        """Adds the outcomes of actions, 0 where the mask is False."""
        if mask is not self._all:
            for name in _task.INFO_FIELDS:
                self._add(infos, name, np.where(mask, rows[name], False), mask)
            return
        rows = rows.copy()  # one copy of all fields, and one read-only mask
        for name, mark in MARKED_FIELDS:
            infos[name], infos[mark] = rows[name], mask

    def _add_ends(self, infos: dict[str, Any], step: BatchStep) -> None:
        """Adds metrics and, with SAME_STEP, the last observations and infos of the episodes that ended."""
        ended = np.zeros(self.num_envs, np.bool_)
        ended[step.finished] = True
        metrics: dict[str, Any] = {}
        for name in _task.METRIC_FIELDS:
            values = step.final_metrics[name]
            row = np.zeros(self.num_envs, np.int64 if values.dtype.kind == "u" else values.dtype)
            row[step.finished] = values
            self._add(metrics, name, row, ended)
        if not self._same_step:
            self._add(infos, "metrics", metrics, ended)
            return
        final: dict[str, Any] = {}
        self._add_step_info(final, step.infos, ended)
        self._add(final, "metrics", metrics, ended)
        self._add(infos, "final_info", final, ended)
        observations = np.full(self.num_envs, None, object)
        goals = step.final_point_goals.astype(np.float32)
        for i, e in enumerate(step.finished):
            images: dict[str, Any] = {**step.final_images, **step.final_on_backend}
            observations[e] = {name: image[i] for name, image in images.items()}
            observations[e][_task.POINT_GOAL] = goals[i]
        self._add(infos, "final_obs", observations, ended)

    def _add_begun(self, infos: dict[str, Any], ended: list[int]) -> None:
        """With SAME_STEP, the infos of the episodes that have begun."""
        for e in ended:
            fresh = self.simulator.world(e).last_step
            for name in _task.INFO_FIELDS:
                infos[name][e] = getattr(fresh, name)
