# SPDX-License-Identifier: Apache-2.0
"""Plays lists of episodes in a VectorEnv. gsnav.ray does so on many machines."""

from __future__ import annotations

import enum
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _task
from ._gsnav import EpisodeMetrics
from ._vector_env import Observation, VectorEnv

# Returns the actions [N] for observations and the index of each environment's episode, int64 [N].
Policy = Callable[[Observation, npt.NDArray[np.int64]], Any]


@dataclass
class Rollout:
    """One episode as it was played, with T actions."""

    episode: int  # Index in the list of episodes.
    id: str
    actions: npt.NDArray[np.int8]  # [T]
    rewards: npt.NDArray[np.float64]  # [T]
    metrics: EpisodeMetrics
    observations: Observation  # Before each action, [T][...]; those named in `keep`.

    def line(self) -> str:
        """The episode's line in a journal, with the fields of a journal of gsnav-eval. Infinity is null."""
        metrics = {n: v if not isinstance(v, float) or math.isfinite(v) else None
                   for n, v in _task.metrics_dict(self.metrics).items()}
        return json.dumps({"episode": self.episode, "id": self.id, "reward": sum(self.rewards.tolist()),
                           "metrics": metrics, "actions": "".join(map(str, self.actions.tolist()))})


def plain(value: Any) -> Any:
    """A value that JSON does not know, in plain types."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, enum.Enum):
        return str(value)
    return value.__getstate__()


class Player:
    """Plays pieces in a vector environment. It is what an actor runs."""

    def __init__(self, environments: int, scene: Any, settings: dict[str, Any]) -> None:
        self._make = lambda: VectorEnv(environments, scene, episodes=self._next, autoreset_mode="SameStep", **settings)
        self._envs: VectorEnv | None = None
        self._piece: list[tuple[int, _task.Episode]] = []
        self._given = 0
        self._playing = np.full(environments, -1, np.int64)

    def _next(self, environment: int, count: int) -> _task.Episode:
        spare = self._given >= len(self._piece)  # All are given out: repeat one, and ignore its results.
        self._playing[environment] = -1 if spare else self._piece[self._given][0]
        self._given += not spare
        return self._piece[0 if spare else self._given - 1][1]

    def ready(self) -> bool:
        """Creates the environments. An exception of __init__ would be the death of the actor to Ray."""
        self._envs = self._envs or self._make()
        return True

    def play(self, piece: list[tuple[int, _task.Episode]], make_policy: Callable[[VectorEnv], Policy],
             keep: Sequence[str]) -> list[Rollout]:
        """Plays the episodes of a piece. Their results are in the order of the piece."""
        self.ready()
        assert self._envs is not None
        self._piece, self._given = piece, 0
        seen, _ = self._envs.reset()
        policy = make_policy(self._envs)
        rows: list[list[tuple[int, float, dict[str, Any]]]] = [[] for _ in self._playing]
        done: dict[int, Rollout] = {}
        while len(done) < len(piece):
            playing = self._playing.copy()
            last, actions = seen, np.asarray(policy(seen, playing))
            seen, rewards, terminated, truncated, infos = self._envs.step(actions)
            for e, index in enumerate(playing.tolist()):
                if index >= 0:
                    rows[e].append((int(actions[e]), float(rewards[e]), {k: last[k][e] for k in keep}))
                if index >= 0 and (terminated[e] or truncated[e]):
                    done[index] = self._rollout(index, rows[e], infos["final_info"]["metrics"], e)
                    rows[e] = []
        return [done[index] for index, _ in piece]

    def _rollout(self, index: int, rows: Any, metrics: Any, e: int) -> Rollout:
        episode: Any = dict(self._piece)[index]
        actions, rewards, images = zip(*rows)
        return Rollout(index, getattr(episode, "episode", episode).id, np.array(actions, np.int8), np.array(rewards),
                       EpisodeMetrics(**{n: metrics[n][e].item() for n in _task.METRIC_FIELDS}),
                       {k: np.stack([image[k] for image in images]) for k in images[0]})
