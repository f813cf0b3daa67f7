# SPDX-License-Identifier: Apache-2.0
"""Plays episodes on the machines of a Ray cluster. `pip install "gsnav[ray]"` installs Ray.

Each actor owns a VectorEnv. Episodes are handed out in pieces. How a piece is played depends on the piece
alone, so any number of actors gives the bits of a single process, and so does a run in which actors die.
"""

from __future__ import annotations

import hashlib
import heapq
import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from . import _task
from ._errors import BackendFailure, ClosedEnvironment, InvalidArgument
from ._gsnav import EpisodeMetrics, SimulatorConfig
from ._rollout import Player, Policy, Rollout, plain
from ._vector_env import VectorEnv

__all__ = ["Policy", "Rollout", "Workers"]

DEATHS = 3  # A piece whose actors die this often is an error.


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
        scenes = [one if isinstance(one, str) else "" for one in (scene if isinstance(scene, list) else [scene])]
        self._identity = [environments, scenes, settings.get("config", SimulatorConfig())]
        self._arguments = (environments, scene, settings)
        self._local = None if actors else Player(*self._arguments)
        self._actors: list[Any] = []
        if actors:
            import ray

            self._class: Any = ray.remote(Player).options(**{"num_cpus": 1, **(options or {})})
            self._actors = [self._class.remote(*self._arguments) for _ in range(actors)]

    def rollouts(self, episodes: Sequence[_task.Episode], make_policy: Callable[[VectorEnv], Policy], *,
                 piece: int = 64, keep: Sequence[str] = (), first: int = 0) -> Iterator[Rollout]:
        """Plays episodes and yields them in order, from index `first`.

        make_policy: called with the VectorEnv at the start of each piece. It returns a function
            `policy(observations, playing)`, which returns the actions [N]. `playing`, int64 [N], has the index
            of each environment's episode, or -1 if its actions do not count. The actions of an episode must
            depend on the piece only, so random numbers need seeds of the episode.
        piece: number of episodes that an actor plays at a time. The results depend on it only where a policy
            or the noise of a sensor depends on the environment's index.
        keep: names of observations to return. They travel over the network.
        """
        if piece < 1:
            raise InvalidArgument(f"piece = {piece}: must be positive")
        if not self._local and not self._actors:
            raise ClosedEnvironment("Workers: the actors have ended; create new ones")
        indexed = list(enumerate(episodes))[first:]
        pieces = [indexed[i:i + piece] for i in range(0, len(indexed), piece)]
        local = self._local
        here = (local.play(one, make_policy, keep) for one in pieces) if local else None
        for rollouts in here or self._remote(pieces, make_policy, keep):
            yield from rollouts

    def evaluate(self, episodes: Sequence[_task.Episode], make_policy: Callable[[VectorEnv], Policy],
                 journal: str | os.PathLike[str], *, piece: int = 64) -> list[EpisodeMetrics]:
        """Plays episodes and writes a line for each to `journal`, in order. Returns their metrics.

        An existing journal of the same evaluation is continued. Use the policy that it was begun with.
        """
        content = hashlib.sha256(json.dumps([*self._identity, *episodes], default=plain).encode()).hexdigest()
        header = json.dumps({"journal": "gsnav.ray", "format": 1, "piece": piece, "content": content}) + "\n"
        lines: list[str] = []
        if os.path.exists(journal):
            with open(journal, encoding="utf-8") as f:
                lines = f.read().split("\n")[:-1]  # Without a line that was cut off.
            if lines and lines[0] + "\n" != header:
                raise InvalidArgument(f"{os.fspath(journal)} is of other episodes, scenes, settings or pieces: use "
                                      "another name, or remove it")
        whole = len(episodes) if len(lines) > len(episodes) else max(len(lines) - 1, 0) // piece * piece
        kept = lines[1:whole + 1]
        read: list[dict[str, Any]] = [json.loads(line)["metrics"] for line in kept]
        metrics = [EpisodeMetrics(**{n: math.inf if v is None else v for n, v in m.items()}) for m in read]
        with open(os.fspath(journal) + ".part", "w", encoding="utf-8") as f:
            f.write("".join([header, *(line + "\n" for line in kept)]))
        os.replace(f.name, journal)
        with open(journal, "a", encoding="utf-8") as f:
            for one in self.rollouts(episodes, make_policy, piece=piece, first=whole):
                print(one.line(), file=f, flush=True)
                metrics.append(one.metrics)
        return metrics

    def close(self) -> None:
        """Ends the actors."""
        if self._actors:
            import ray

            for actor in self._actors:
                ray.kill(actor)
        self._actors, self._local = [], None

    def _remote(self, pieces: list[Any], make_policy: Any, keep: Any) -> Iterator[list[Rollout]]:
        import ray

        policy, window = ray.put(make_policy), 4 * len(self._actors)
        todo, deaths = list(range(len(pieces))), [0] * len(pieces)  # `todo` is a heap.
        done: dict[int, list[Rollout]] = {}
        idle: list[Any] = []
        working = {actor.ready.remote(): (actor, -1) for actor in self._actors}
        at, without_success = 0, 0  # `at` is the piece that is yielded next.
        while at < len(pieces):
            while idle and todo and todo[0] < at + window:  # Later results would wait in memory.
                actor, index = idle.pop(), heapq.heappop(todo)
                working[actor.play.remote(pieces[index], policy, keep)] = (actor, index)
            (future,), _ = ray.wait(list(working), num_returns=1)
            actor, index = working.pop(future)
            try:
                result = ray.get(future)
            except ray.exceptions.RayActorError as e:
                self.deaths, without_success = self.deaths + 1, without_success + 1
                if index >= 0:
                    deaths[index] += 1
                    heapq.heappush(todo, index)
                if max(deaths) >= DEATHS or without_success > DEATHS * len(self._actors):
                    raise BackendFailure(f"gsnav.ray: actors died again and again: {e}") from e
                self._actors.remove(actor)
                actor = self._class.remote(*self._arguments)
                self._actors.append(actor)
                working[actor.ready.remote()] = (actor, -1)
                continue
            idle.append(actor)
            if index >= 0:
                done[index], without_success = result, 0
            while at in done:
                yield done.pop(at)
                at += 1
