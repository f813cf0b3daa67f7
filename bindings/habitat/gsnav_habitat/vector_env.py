# SPDX-License-Identifier: Apache-2.0
"""Environments of habitat-baselines in the process of the trainer, which share scenes and renderers."""

import atexit
import collections
import contextlib
import copy
import threading
import weakref
from typing import Any, Callable

import numpy as np
from habitat.core import vector_env as _theirs
from habitat_baselines.common import habitat_env_factory as _factory
from habitat_sim import _engine

from ._turns import Turns

_lock = threading.Lock()


class _Worker:
    """An environment, which answers the commands of habitat.VectorEnv when an answer is read."""

    def __init__(self, turns: Turns, auto_reset: bool) -> None:
        self._turns, self._auto_reset = turns, auto_reset
        self._asked: collections.deque[tuple[str, Any]] = collections.deque()
        self._answers: collections.deque[tuple[Any, BaseException | None]] = collections.deque()
        self._env: Any = None

    def ask(self, command: tuple[str, Any]) -> None:
        """Takes a command. It is carried out when it or one of another worker is awaited."""
        self._asked.append(command)

    def is_asked(self) -> bool:
        """Whether there are commands to carry out."""
        return bool(self._asked)

    def take(self) -> Any:
        """Result of the oldest command that was carried out. Raises what the environment raised."""
        value, error = self._answers.popleft()
        if error is not None:
            raise error
        return value

    def has_answer(self) -> bool:
        """Whether `take` has a result."""
        return bool(self._answers)

    def end(self) -> None:
        """Asks for the environment to be closed. Drops commands, and answers that were not read."""
        for _, error in self._answers:
            if error is not None:
                _engine.logger.warning("BatchVectorEnv.close: an environment raised, unread: %r", error)
        self._answers.clear()
        self._asked.clear()
        self.ask((_theirs.CLOSE_COMMAND, None))

    def join(self) -> None:
        """Closes the environment, after it was asked to."""
        self._turns.run([(self, self.work)])

    def work(self) -> None:
        """Carries out the commands so far."""
        while self._asked:
            command, data = self._asked.popleft()
            if command == _theirs.CLOSE_COMMAND:
                env, self._env = self._env, None
                if env is not None:
                    env.close()
                return
            try:
                self._answers.append((self._do(command, data), None))
            except BaseException as error:  # It is raised where the result is read.
                self._answers.append((None, error))

    def _do(self, command: str, data: Any) -> Any:
        env = self._env
        if command == _theirs.STEP_COMMAND:
            seen, reward, done, info = env.step(data)
            info = copy.deepcopy(info)  # Measures change their arrays in place.
            return _packed(env.reset() if done and self._auto_reset else seen), reward, done, info
        if command == _theirs.RESET_COMMAND:
            return _packed(env.reset())
        if command == _theirs.RENDER_COMMAND:
            return env.render(*data[0], **data[1])
        if command == _theirs.CALL_COMMAND:
            name, arguments = data
            found = getattr(env, name)
            return found(**(arguments or {})) if arguments or callable(found) else found
        if command == _theirs.COUNT_EPISODES_COMMAND:
            return len(env.episodes)
        if command == "make":
            make, arguments = data
            self._env = _theirs.EnvCountEpisodeWrapper(_theirs.EnvObsDictWrapper(make(*arguments)))
            return None
        raise NotImplementedError(f"gsnav.habitat: habitat.VectorEnv's command {command!r}")


def _packed(seen: Any) -> Any:
    """Observations whose colours have no gaps: the trainer copies these ten times as fast."""
    for name, image in seen.items():
        if isinstance(image, np.ndarray) and image.ndim == 3 and image.shape[2] == 3 and image.dtype == np.uint8:
            if not image.flags.c_contiguous:
                seen[name] = _engine.library().FreeSensors.packed(image)
    return seen


class BatchVectorEnv(_theirs.VectorEnv):
    """habitat.VectorEnv without processes.

    The first read carries out the commands of all environments: one runs Python at a time, and meanwhile the images of
    others are drawn on the cores of the CPU, or many together on a GPU.
    """

    def _spawn_workers(
        self, env_fn_args: Any, make_env_fn: Any, workers_ignore_signals: bool = False
    ) -> tuple[list[Any], list[Any]]:
        cores, count = _engine.threads(), len(env_fn_args)
        # On a GPU a quarter is drawn in one call, while the others run Python.
        self._turns = Turns(min(cores, count), share=max(1, cores // count), together=-(-count // 4))
        self._everyone = [_Worker(self._turns, self._auto_reset_done) for _ in range(count)]
        self._workers = list(self._everyone)
        self._reads = [self._reader(worker, rank) for rank, worker in enumerate(self._everyone)]
        writes = [_theirs._WriteWrapper(worker.ask, read) for worker, read in zip(self._everyone, self._reads)]
        try:
            for worker, arguments in zip(self._everyone, env_fn_args):
                worker.ask(("make", (make_env_fn, arguments)))
                self._run()  # One after the other: they open the same scenes.
                worker.take()
            _open.add(self)
        except BaseException:
            for worker in self._everyone:
                worker.ask((_theirs.CLOSE_COMMAND, None))
            self._run()
            self._turns.close()
            raise
        return list(self._reads), writes

    def _reader(self, worker: _Worker, rank: int) -> Callable[[], Any]:
        def read() -> Any:
            try:
                if not worker.has_answer():
                    self._run()
                return worker.take()
            except BaseException:  # _ReadWrapper waits on, also where no other answer comes.
                wrapper.is_waiting = worker.is_asked() or worker.has_answer()
                raise

        wrapper = _theirs._ReadWrapper(read, rank)
        return wrapper

    def _run(self) -> None:
        self._turns.run([(worker, worker.work) for worker in self._everyone if worker.is_asked()])

    def close(self) -> None:
        """Closes the environments. Drops results that were not read, and logs errors among them."""
        if self._is_closed:
            return
        try:
            for worker in self._everyone:
                worker.end()
            self._run()  # All close, and then the first error is raised.
        finally:
            for read in self._reads:
                read.is_waiting = False
            try:
                super().close()
            finally:
                self._is_closed = True
                self._turns.close()


_open: "weakref.WeakSet[BatchVectorEnv]" = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Closes what a program leaves open, after Ctrl-C for example. Later, no thread would answer."""
    for envs in list(_open):
        with contextlib.suppress(Exception):  # A step that was not read may have to draw, which is too late.
            envs.close()


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
