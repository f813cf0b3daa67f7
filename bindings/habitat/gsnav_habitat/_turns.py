# SPDX-License-Identifier: Apache-2.0
"""Turns of threads: one runs Python at a time, with random numbers of its own, and images are drawn outside turns."""

import contextlib
import random
import threading
from typing import Any, Iterator

import numpy as np

_here = threading.local()


class Turns:
    """Threads that take turns. At most `drawers` of them draw at a time, each on `share` threads of the CPU.

    Each participant, and the thread that waits for them, keeps the states of `random` and `numpy.random`, as
    processes do. A new participant begins with those of that thread.
    """

    def __init__(self, drawers: int, share: int) -> None:
        self.share = share
        from queue import SimpleQueue  # Imported here because habitat_sim, which imports this file, must be light.

        self._lock = threading.Lock()
        self._permits: SimpleQueue[None] = SimpleQueue()  # Faster than a semaphore.
        for _ in range(drawers):
            self._permits.put(None)
        self._states: dict[Any, Any] = {}
        self._last: Any = None  # The participant whose random numbers are in place; None: those of all others.

    def _swap(self, who: Any) -> None:
        if who == self._last:
            return
        now = random.getstate(), np.random.get_state()
        self._states[self._last], self._last = now, who
        new = self._states.pop(who, None) or self._states[None]
        random.setstate(new[0])
        np.random.set_state(new[1])

    @contextlib.contextmanager
    def turn(self, who: Any) -> Iterator[None]:
        """Runs the body as a turn of a participant, any hashable object but None."""
        with self._lock:
            self._swap(who)
            _here.at = self, who
            try:
                yield
            finally:
                _here.at = None

    @contextlib.contextmanager
    def _drawing(self, who: Any) -> Iterator[None]:
        self._lock.release()
        self._permits.get()
        try:
            yield
        finally:
            self._permits.put(None)
            self._lock.acquire()
            self._swap(who)

    def finish(self) -> None:
        """Puts the random numbers of the thread that waited back."""
        with self._lock:
            self._swap(None)


def drawing() -> Any:
    """A context in which other threads may take their turns, if the present thread has one."""
    at = getattr(_here, "at", None)
    return contextlib.nullcontext() if at is None else at[0]._drawing(at[1])


def share() -> int | None:
    """How many threads of the CPU the present thread may draw on; None: all."""
    at = getattr(_here, "at", None)
    return None if at is None else at[0].share
