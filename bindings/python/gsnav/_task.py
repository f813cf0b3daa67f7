# SPDX-License-Identifier: Apache-2.0
"""What Env and VectorEnv share: scenes, spaces, episodes and information about steps."""

from __future__ import annotations

import contextlib
import copy
import enum
import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from . import _memory
from ._call_errors import short
from ._errors import InvalidArgument, OutOfMemory
from ._gsnav import (
    BatchEpisode,
    EpisodeMetrics,
    EpisodeRules,
    OpenedScene,
    OpenOptions,
    PointNavEpisode,
    Rng,
    SensorKind,
    SensorSpec,
    SimulatorConfig,
    SimulatorScene,
    StepInfo,
    generate_episode,
    open_scene,
)
from ._spaces import Box, Dict, Discrete

# Discrete actions of PointNav: stop, move_forward, turn_left, turn_right.
ACTIONS = 4
POINT_GOAL = "point_goal"
_MOST_DRAWN = 10**6  # Episodes of an iterator.
# Memory of an environment without sensors: its generator and its world.
ENVIRONMENT_BYTES = 2000
# Bound of values without one. Gymnasium warns of infinite bounds.
LARGEST = float(np.finfo(np.float32).max)
# Fields of StepInfo that environments report at each step. The reward is returned on its own.
INFO_FIELDS = ("collided", "wall_collision", "capsule_blocked", "avatar_contact", "avatar_touched", "pushed_into",
               "moved", "avatar_clearance")
METRIC_FIELDS = ("success", "spl", "soft_spl", "stl", "distance_to_goal", "euclidean_distance_to_goal",
                 "collision_rate", "psi", "psc", "human_collision", "human_blocked", "collisions",
                 "collision_steps", "steps", "start_distance", "path_length", "min_clearance", "stop_called")

Scene = str | os.PathLike[str] | OpenedScene | SimulatorScene
Episode = PointNavEpisode | BatchEpisode
EpisodeSource = Callable[[int, int], Episode]


def from_dlpack(value: Any, what: str) -> Any:
    """A numpy array that shares the memory of another library's array. Other values are returned as they are."""
    if isinstance(value, (np.ndarray, np.generic)) or not hasattr(value, "__dlpack__"):
        return value
    try:
        return np.from_dlpack(value)
    except (BufferError, RuntimeError, TypeError, ValueError) as e:
        raise InvalidArgument(f"{what}: an array that numpy cannot read; pass one in host memory: {e}") from e


def count(value: Any, what: str, least: int = 0) -> int:
    """An integer of at least `least`. A bool is none."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{what}: expected an integer, got {short(value)}")
    if value < least:
        raise InvalidArgument(f"{what} = {short(value)}: must be at least {least}")
    if value >= 2**2048:
        raise InvalidArgument(f"{what} = {short(value)}: must be below 2^2048")
    return int(value)


def checked_seed(seed: Any, what: str = "seed") -> int | None:
    """A seed as an integer, or None."""
    return None if seed is None else count(seed, what)


def function(value: Any, what: str) -> None:
    """Raises TypeError if a value cannot be called."""
    if not callable(value):
        raise TypeError(f"{what}: expected a function, got {short(value)}")


def known(names: Iterable[str], present: Mapping[str, Any], what: str) -> None:
    """Raises InvalidArgument for a name that is not there."""
    for name in names:
        if name not in present:
            raise InvalidArgument(f"{what}: there is no {short(name)}; there are {', '.join(present)}")


def names(value: Any, what: str) -> list[str]:
    """A list of names."""
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise TypeError(f"{what}: expected a sequence of names, got {short(value)}")
    return list(value)


def option(options: Any, name: str) -> Any:
    """The option of a reset, or None."""
    if options is None:
        return None
    if not isinstance(options, Mapping):
        raise TypeError(f"options: expected a dict or None, got {short(options)}")
    return options.get(name)


@contextlib.contextmanager
def undone_if_it_fails(env: Any, generators: list[np.random.Generator]) -> Iterator[None]:
    """Gives an environment its own generator, and `generators`, back as they were if the body raises."""
    own, seed, others = env._np_random, env._np_random_seed, list(generators)
    known = others if own is None else [*others, own]
    states = [g.bit_generator.state for g in known]
    try:
        yield
    except BaseException:
        env._np_random, env._np_random_seed, generators[:] = own, seed, others
        for generator, state in zip(known, states):
            generator.bit_generator.state = state
        raise


def checked(value: Any, kinds: type | tuple[type, ...], what: str) -> None:
    """Raises TypeError, with the name of the argument, if a value has another type."""
    kinds = kinds if isinstance(kinds, tuple) else (kinds,)
    if not isinstance(value, kinds):
        names = ["None" if kind is type(None) else kind.__name__ for kind in kinds]
        raise TypeError(f"{what}: expected {' or '.join(names)}, got {short(value)}")


def settings(config: Any) -> SimulatorConfig:
    """The settings of environments; the defaults for None."""
    checked(config, (SimulatorConfig, type(None)), "config")
    return SimulatorConfig() if config is None else config


def scene_of(scene: Scene, config: SimulatorConfig) -> SimulatorScene:
    """The scene with a NavMesh. A name is opened, and a NavMesh is built for the agent if none is there."""
    if isinstance(scene, (str, os.PathLike)):
        if "\0" in str(os.fspath(scene)):
            raise InvalidArgument(f"scene = {short(scene)}: no name of a file has the character 0")
        options = OpenOptions(navmesh="auto", agent_radius=config.task.agent_radius,
                              agent_height=config.task.agent_height)
        scene = open_scene(scene, options)
    if isinstance(scene, OpenedScene):
        scene = scene.scene
    if not isinstance(scene, SimulatorScene):
        raise TypeError("scene: expected a name, a path, an OpenedScene or a SimulatorScene, got "
                        f"{type(scene).__name__}")
    if scene.navmesh is None:
        raise InvalidArgument("scene: it has no NavMesh. Open it with OpenOptions(navmesh=\"auto\").")
    return scene


def image_shape(sensor: SensorSpec) -> tuple[int, int, int]:
    """Shape of the images of a sensor, [H][W][C]."""
    height, width = sensor.resolution
    return height, width, 3 if sensor.kind in (SensorKind.rgb, SensorKind.normal) else 1


def sensor_space(sensor: SensorSpec) -> Box:
    """Space of the images of a sensor, float32 [H][W][C]."""
    shape = image_shape(sensor)
    if sensor.kind == SensorKind.rgb:
        return Box(0.0, LARGEST, shape, np.float32)
    if sensor.kind == SensorKind.normal:
        return Box(-1.0, 1.0, shape, np.float32)
    if sensor.kind == SensorKind.depth:
        # Depth is below 0 where the camera is inside a Gaussian (docs/reference/image_contract.md).
        far = min(sensor.far_plane, LARGEST)  # It may be infinite.
        return Box(-far, far, shape, np.float32)
    high = 1.0 if sensor.kind == SensorKind.alpha else LARGEST
    return Box(0.0, high, shape, np.float32)


@contextlib.contextmanager
def memory_for_spaces(config: SimulatorConfig, environments: int) -> Iterator[None]:
    """Checks the sensors, and names them if there is no memory for the spaces of their images."""
    for sensor in config.sensors:
        sensor.validate()
    try:
        numbers = sum(math.prod(image_shape(s)) for s in config.sensors)
        if lack := _memory.lack(environments * (8 * numbers + ENVIRONMENT_BYTES)):  # two bounds of 4 bytes
            raise MemoryError(lack)
        yield
    except (MemoryError, OverflowError) as e:
        sizes = ", ".join(f"{s.uuid!r}: resolution = {list(s.resolution)}" for s in config.sensors) or "no sensors"
        raise OutOfMemory(f"config.sensors: no memory for the spaces of {environments} environments ({sizes}): "
                          f"{e}") from e


def observation_space(config: SimulatorConfig) -> Dict:
    """Space of observations: an image per sensor, and the goal as distance (metres) and angle (radians)."""
    if not config.rendering:
        raise InvalidArgument("config.rendering = False: environments need images; leave the sensors out instead")
    spaces = {}
    for sensor in config.sensors:
        if sensor.uuid == POINT_GOAL:
            raise InvalidArgument(f"config.sensors: the name {POINT_GOAL!r} is taken by the goal; use another uuid")
        spaces[sensor.uuid] = sensor_space(sensor)
    low, high = np.array([0, -math.pi], np.float32), np.array([LARGEST, math.pi], np.float32)
    spaces[POINT_GOAL] = Box(low, high, dtype=np.float32)
    return Dict(spaces)


def action_space() -> Discrete:
    """Stop, move forward, turn left, turn right."""
    return Discrete(ACTIONS)


def rgb_sensor(config: SimulatorConfig, render_mode: str | None) -> str:
    """Name of the sensor whose image `render` returns."""
    if render_mode is not None and (not isinstance(render_mode, str) or render_mode != "rgb_array"):
        raise InvalidArgument(f"render_mode = {short(render_mode)}: use None or \"rgb_array\"")
    names = [s.uuid for s in config.sensors if s.kind == SensorKind.rgb]
    if render_mode is not None and not names:
        raise InvalidArgument("render_mode = \"rgb_array\": add an RGB sensor to config.sensors")
    return names[0] if names else ""


def metrics_dict(metrics: EpisodeMetrics) -> dict[str, Any]:
    """The metrics as numbers by their names."""
    return {name: getattr(metrics, name) for name in METRIC_FIELDS}


def info_dict(info: StepInfo) -> dict[str, Any]:
    """The outcome of an action as numbers by their names."""
    return {name: getattr(info, name) for name in INFO_FIELDS}


def without_scene(episode: Episode) -> PointNavEpisode:
    """The episode, without the number of its scene."""
    return episode.episode if isinstance(episode, BatchEpisode) else episode


def plain(value: Any) -> Any:
    """A value that JSON does not know, in plain types."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return str(value) if isinstance(value, enum.Enum) else value.__getstate__()


class Episodes:
    """Source of the episodes of one environment."""

    def __init__(self, scenes: Sequence[SimulatorScene], episodes: Sequence[Episode] | None,
                 rules: EpisodeRules | None) -> None:
        self._scenes = scenes
        checked(rules, (EpisodeRules, type(None)), "rules")
        self._rules = EpisodeRules() if rules is None else copy.copy(rules)  # The caller may change its own.
        self.given: list[BatchEpisode] | None = None  # Copies of the episodes.
        if episodes is not None:
            if isinstance(episodes, (str, Mapping)) or not isinstance(episodes, Iterable):
                raise TypeError(f"episodes: expected a sequence of episodes, got {short(episodes)}")
            if not isinstance(episodes, Sequence):  # It may be endless.
                episodes = list(itertools.islice(episodes, _MOST_DRAWN + 1))
                if len(episodes) > _MOST_DRAWN:
                    raise InvalidArgument(f"episodes: an iterator of more than {_MOST_DRAWN}; pass a list")
            self.given = [self._checked(e, i) for i, e in enumerate(episodes)]
            if not self.given:
                raise InvalidArgument("episodes: the list is empty; use None to sample episodes")

    def _checked(self, episode: Episode, index: int) -> BatchEpisode:
        if isinstance(episode, PointNavEpisode):
            return BatchEpisode(scene=0, episode=episode)
        if not isinstance(episode, BatchEpisode):
            raise TypeError(f"episodes[{index}]: expected a PointNavEpisode or a BatchEpisode, "
                            f"got {type(episode).__name__}")
        if episode.scene >= len(self._scenes):
            raise InvalidArgument(f"episodes[{index}].scene = {episode.scene}: there are {len(self._scenes)} scenes")
        return BatchEpisode(scene=episode.scene, episode=episode.episode)

    def draw(self, generator: np.random.Generator) -> BatchEpisode:
        """The next episode: a random one of the list, or a sampled one in a random scene."""
        if self.given is not None:
            return self.given[int(generator.integers(len(self.given)))]
        index = int(generator.integers(len(self._scenes))) if len(self._scenes) > 1 else 0
        navmesh = self._scenes[index].navmesh
        assert navmesh is not None  # scene_of has checked it
        episode = generate_episode(navmesh, Rng(int(generator.integers(2**63))), self._rules)
        return BatchEpisode(scene=index, episode=episode)
