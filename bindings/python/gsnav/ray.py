# SPDX-License-Identifier: Apache-2.0
"""Plays episodes on the machines of a Ray cluster. `pip install "gsnav[ray]"` installs Ray.

Each actor owns a VectorEnv and plays pieces of the list of episodes. How a piece is played depends on the piece
alone. Any number of actors, even if some of them die, therefore gives the bits of a single process.
"""

from __future__ import annotations

import collections
import copy
import heapq
import os
import pathlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from . import _journal, _task
from ._errors import BackendFailure, ClosedEnvironment
from ._gsnav import EpisodeMetrics
from ._vector_env import Observation, VectorEnv

# Returns the actions [N] for observations and the index of each environment's episode, int64 [N].
Policy = Callable[[Observation, npt.NDArray[np.int64]], Any]
DEATHS = 3  # A piece whose actors die this often is an error.


@dataclass
class Rollout:
    """One episode as it was played, with T actions."""
    episode: int  # Index in the list of episodes.
    id: str
    actions: npt.NDArray[np.int8]  # [T]
    rewards: npt.NDArray[np.float64]  # [T]
    metrics: EpisodeMetrics
    observations: Observation  # Before each action, [T][...]; those named in `keep`.


class Player:
    """Plays pieces in a vector environment. It is what an actor runs."""
    def __init__(self, environments: int, scene: Any, settings: dict[str, Any]) -> None:
        self._settings: dict[str, Any] = {**settings, "autoreset_mode": "SameStep", "episodes": self._next}
        self._scene, self._envs = scene, cast(Any, None)
        self._piece: list[tuple[int, _task.Episode]] = []
        self._given, self._playing = 0, np.full(environments, -1, np.int64)

    def _next(self, environment: int, count: int) -> _task.Episode:
        spare = self._given >= len(self._piece)  # All are given out: repeat one, and ignore its results.
        self._playing[environment] = -1 if spare else self._piece[self._given][0]
        self._given += not spare
        return self._piece[0 if spare else self._given - 1][1]

    def ready(self) -> bool:
        """Creates the environments. An exception of __init__ would be the death of the actor to Ray."""
        self._envs = self._envs or VectorEnv(len(self._playing), self._scene, **self._settings)
        return True

    def play(self, piece: list[tuple[int, _task.Episode]], make_policy: Callable[[VectorEnv], Policy],
             keep: Sequence[str]) -> list[Rollout]:
        """Plays the episodes of a piece. Their results are in the order of the piece."""
        self.ready()
        envs, episodes, self._piece, self._given = self._envs, dict(piece), piece, 0
        seen, policy = envs.reset()[0], make_policy(envs)
        _task.function(policy, "make_policy(envs)")
        _task.known(keep, seen, "keep")
        rows: list[list[tuple[int, float, dict[str, Any]]]] = [[] for _ in self._playing]
        done: dict[int, Rollout] = {}
        while len(done) < len(piece):
            playing = self._playing.copy()
            actions, counted = np.asarray(policy(seen, playing)), np.flatnonzero(playing >= 0)
            before = {e: {k: seen[k][e].copy() for k in keep} for e in counted}  # The step may overwrite them.
            seen, rewards, terminated, truncated, infos = envs.step(actions)
            for e in counted:
                index = int(playing[e])
                rows[e].append((int(actions[e]), float(rewards[e]), before[e]))
                if not (terminated[e] or truncated[e]):
                    continue
                (taken, gained, images), rows[e] = zip(*rows[e]), []
                metrics = infos["final_info"]["metrics"]
                episode = _task.without_scene(episodes[index])
                done[index] = Rollout(index, episode.id, np.array(taken, np.int8), np.array(gained),
                                      EpisodeMetrics(**{n: metrics[n][e].item() for n in _task.METRIC_FIELDS}),
                                      {k: np.stack([image[k] for image in images]) for k in keep})
        return [done[index] for index in episodes]


class Workers:
    """Actors that play episodes. Create it once: its actors keep their scenes."""
    def __init__(self, scene: Any = "default", *, actors: int, environments: int = 16, options: Any = None,
                 **settings: Any) -> None:
        """Creates the actors.

        scene: a name or a list of names, which each actor opens. Without actors also scenes.
        actors: number of actors. 0 plays in this process, without Ray.
        environments: number of environments of each actor.
        options: Ray's options of an actor, such as dict(num_gpus=1). By default an actor takes one CPU.
        settings: other arguments of VectorEnv, such as `config` and `device`.
        """
        self.deaths = 0  # Number of actors that died and were replaced.
        environments, actors = _task.count(environments, "environments", 1), _task.count(actors, "actors")
        _task.checked(options, (dict, type(None)), "options")
        settings = {**settings, "config": copy.deepcopy(_task.settings(settings.get("config")))}
        scenes = list(scene) if isinstance(scene, (list, tuple)) else [scene]
        self._identity = [environments, [_journal.resolved(one) for one in scenes], settings["config"]]
        self._arguments = (environments, scene, settings)
        self._local = None if actors else Player(environments, self._identity[1], settings)
        self._actors: list[Any] = []
        if actors:
            import ray
            self._ray: Any = ray
            self._class: Any = ray.remote(Player).options(**{"num_cpus": 1, **(options or {})})
            self._actors = [self._class.remote(*self._arguments) for _ in range(actors)]

    def rollouts(self, episodes: Sequence[_task.Episode], make_policy: Callable[[VectorEnv], Policy], *,
                 piece: int = 64, keep: Sequence[str] = (), first: int = 0) -> Iterator[Rollout]:
        """Plays episodes and yields them in order, from index `first`.

        make_policy: called with the VectorEnv at the start of each piece. It returns the function
            `policy(observations, playing)`, which returns actions [N]. `playing`, int64 [N], has the index of each
            environment's episode, or -1 if its actions do not count. The actions of an episode must depend on the
            piece only, so random numbers need seeds of the episode.
        piece: number of episodes that an actor plays at a time. Results depend on it only where a policy or the
            noise of a sensor depends on the environment's index.
        keep: names of observations to return. They travel over the network.
        """
        self._check(make_policy, piece)
        first, keep = _task.count(first, "first"), _task.names(keep, "keep")
        indexed, local = list(enumerate(episodes)), self._local
        pieces = [indexed[i:i + piece] for i in range(first, len(indexed), piece)]
        here = (local.play(one, make_policy, keep) for one in pieces) if local else None
        for rollouts in here or self._remote(pieces, make_policy, keep):
            yield from rollouts

    def evaluate(self, episodes: Sequence[_task.Episode], make_policy: Callable[[VectorEnv], Policy],
                 journal: str | os.PathLike[str], *, piece: int = 64) -> list[EpisodeMetrics]:
        """Plays episodes and writes a line for each to `journal`, in order. Returns their metrics.

        An existing journal of the same evaluation is continued, if it has checksums and no line was edited. Use the
        policy that it was begun with. Scenes must have names, because the journal is of the paths of their files.
        """
        self._check(make_policy, piece)
        episodes = list(episodes)
        header = _journal.header(self._identity, episodes, piece)
        path = pathlib.Path(os.path.realpath(journal))  # A link stays a link.
        lines = _journal.lines(path, header)
        whole = len(episodes) if len(lines) >= len(episodes) else len(lines) // piece * piece
        metrics = _journal.metrics(path, lines, episodes)[:whole]
        _journal.begin(path, [header, *lines[:whole]])
        with path.open("a") as f:
            for one in self.rollouts(episodes, make_policy, piece=piece, first=whole):
                print(_journal.line(one), file=f, flush=True)
                metrics.append(one.metrics)
        return metrics

    def _check(self, make_policy: Any, piece: Any) -> None:
        _task.function(make_policy, "make_policy")
        _task.count(piece, "piece", 1)
        if not self._local and not self._actors:
            raise ClosedEnvironment("Workers: the actors have ended; create new ones")

    def close(self) -> None:
        """Ends the actors."""
        for actor in self._actors:
            self._ray.kill(actor)
        self._actors, self._local = [], None

    def _remote(self, pieces: list[Any], make_policy: Any, keep: Any) -> Iterator[list[Rollout]]:
        ray, gone, policy = self._ray, self._ray.exceptions, self._ray.put(make_policy)
        todo, deaths = list(range(len(pieces))), collections.Counter[int]()  # `todo` is a heap.
        done, idle = dict[int, list[Rollout]](), list[Any]()
        working = {actor.ready.remote(): (actor, -1) for actor in self._actors}
        at, window = 0, 4 * len(self._actors)  # `at` is the piece that is yielded next.
        while at < len(pieces):
            while idle and todo and todo[0] < at + window:  # Later results would wait in memory.
                actor, index = idle.pop(), heapq.heappop(todo)
                working[actor.play.remote(pieces[index], policy, keep)] = (actor, index)
            (future,), _ = ray.wait(list(working), num_returns=1)
            actor, index = working.pop(future)
            try:
                result = ray.get(future)
            except (gone.RayActorError, gone.ObjectLostError, gone.OutOfMemoryError, gone.NodeDiedError) as e:
                self.deaths += 1  # A result may be lost with a node although its actor has ended the piece.
                deaths[index] += 1
                if deaths[index] >= DEATHS * (1 if index >= 0 else len(self._actors)):
                    raise BackendFailure(f"gsnav.ray: actors died again and again: {e}") from e
                self._actors[self._actors.index(actor)] = actor = self._class.remote(*self._arguments)
                working[actor.ready.remote()] = (actor, -1)
                if index >= 0:
                    heapq.heappush(todo, index)
                continue
            idle.append(actor)
            if index >= 0:
                done[index], deaths[-1] = result, 0
            while at in done:
                yield done.pop(at)
                at += 1
