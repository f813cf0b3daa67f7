# SPDX-License-Identifier: Apache-2.0
"""Environments of habitat-baselines in the process of the trainer, which share scenes and renderers' memory."""

import random
import threading
from typing import Any, Callable

import numpy as np
from habitat.core import vector_env as _theirs
from habitat_baselines.common import habitat_env_factory as _factory

_lock = threading.Lock()


class _Worker:
    """An environment that answers the commands of habitat.VectorEnv when an answer is read.

    Processes have random numbers of their own, so each worker keeps the states of `random` and `numpy.random`.
    """

    def __init__(self, make: Callable[..., Any], arguments: tuple[Any, ...], auto_reset: bool) -> None:
        self._auto_reset = auto_reset
        self._asked: list[tuple[str, Any]] = []
        self._random = random.getstate(), np.random.get_state()
        self._env: Any = None
        self._env = self._alone(
            lambda: _theirs.EnvCountEpisodeWrapper(_theirs.EnvObsDictWrapper(make(*arguments)))
        )

    def _alone(self, call: Callable[[], Any]) -> Any:
        outside = random.getstate(), np.random.get_state()
        random.setstate(self._random[0])
        np.random.set_state(self._random[1])
        try:
            return call()
        finally:
            self._random = random.getstate(), np.random.get_state()
            random.setstate(outside[0])
            np.random.set_state(outside[1])

    def ask(self, command: tuple[str, Any]) -> None:
        """Takes a command. All but the last one are carried out by `answer`."""
        if command[0] != _theirs.CLOSE_COMMAND:
            self._asked.append(command)
        elif self._env is not None:
            self._alone(self._env.close)
            self._env = None

    def answer(self) -> Any:
        """Carries out the oldest command and returns its result."""
        command, data = self._asked.pop(0)
        return self._alone(lambda: self._do(command, data))

    def join(self) -> None:
        """Nothing to wait for."""

    def _do(self, command: str, data: Any) -> Any:
        env = self._env
        if command == _theirs.STEP_COMMAND:
            seen, reward, done, info = env.step(data)
            return (env.reset() if done and self._auto_reset else seen), reward, done, info
        if command == _theirs.RESET_COMMAND:
            return env.reset()
        if command == _theirs.RENDER_COMMAND:
            return env.render(*data[0], **data[1])
        if command == _theirs.CALL_COMMAND:
            name, arguments = data
            found = getattr(env, name)
            return found(**(arguments or {})) if arguments or callable(found) else found
        if command == _theirs.COUNT_EPISODES_COMMAND:
            return len(env.episodes)
        raise NotImplementedError(f"gsnav.habitat: habitat.VectorEnv's command {command!r}")


class BatchVectorEnv(_theirs.VectorEnv):
    """habitat.VectorEnv without processes: environments take turns, and each image is drawn by all cores."""

    def _spawn_workers(
        self, env_fn_args: Any, make_env_fn: Any, workers_ignore_signals: bool = False
    ) -> tuple[list[Any], list[Any]]:
        self._workers = [_Worker(make_env_fn, arguments, self._auto_reset_done) for arguments in env_fn_args]
        reads = [_theirs._ReadWrapper(worker.answer, rank) for rank, worker in enumerate(self._workers)]
        writes = [_theirs._WriteWrapper(worker.ask, read) for worker, read in zip(self._workers, reads)]
        return reads, writes


class BatchVectorEnvFactory(_factory.HabitatVectorEnvFactory):
    """Divides scenes and seeds as habitat-baselines does, and makes a BatchVectorEnv. Name it in the setting
    habitat_baselines.vector_env_factory._target_."""

    def construct_envs(self, *args: Any, **kwargs: Any) -> BatchVectorEnv:
        """Takes the arguments of HabitatVectorEnvFactory.construct_envs."""
        # That function names the class it makes in its module. Its rule for scenes and seeds is not repeated here.
        with _lock:
            usual = _factory.VectorEnv
            _factory.VectorEnv = BatchVectorEnv
            try:
                return super().construct_envs(*args, **kwargs)
            finally:
                _factory.VectorEnv = usual
