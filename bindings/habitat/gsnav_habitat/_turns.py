# SPDX-License-Identifier: Apache-2.0
"""Turns of threads: one runs Python at a time, with random numbers of its own, and images are drawn outside turns."""

import contextlib
import threading
from typing import Any, Callable, Iterator

_here = threading.local()


class _Request:
    """A value to draw for a participant, and then the result."""

    def __init__(self, value: Any, draw: Callable[[list[Any]], list[Any]], wake: Any) -> None:
        self.value, self.draw, self.wake = value, draw, wake
        self.result: Any = None
        self.error: BaseException | None = None


class Turns:
    """Threads that take turns. At most `drawers` of them draw at a time, each on `share` threads of the CPU.

    Each participant, and the thread that waits for them, keeps the states of `random` and `numpy.random`, as
    processes do. A new participant begins with those of that thread. `together` is the number of requests that are
    drawn in one call.
    """

    def __init__(self, drawers: int, share: int, together: int = 1) -> None:
        self.share, self._together = share, together
        from queue import SimpleQueue  # Imported here because habitat_sim, which imports this file, must be light.

        from ._numbers import State

        self._queue, self._state_type = SimpleQueue, State
        self._lock = threading.Lock()
        self._permits: SimpleQueue[None] = SimpleQueue()  # Faster than a semaphore.
        for _ in range(drawers):
            self._permits.put(None)
        self._states: dict[Any, Any] = {}
        self._put: Any = None  # The state that was put in place last.
        self._last: Any = None  # The participant whose random numbers are in place; None: those of all others.
        self._guard = threading.Lock()  # For the two below.
        self._coming = 0  # Turns that were announced and neither ended nor wait for a drawing.
        self._waiting: dict[Any, list[_Request]] = {}  # Requests by keys.

    def expect(self, count: int) -> None:
        """Announces turns that will begin. Requests wait for those of announced turns."""
        with self._guard:
            self._coming += count

    def _leave(self, key: Any = None, request: "_Request | None" = None) -> None:
        """Notes that a turn ended or waits for a request. Lets a participant draw each group that need not wait."""
        with self._guard:
            self._coming -= 1
            if request is not None:
                self._waiting.setdefault(key, []).append(request)
            full = [k for k, group in self._waiting.items() if self._coming < 1 or len(group) >= self._together]
            groups = [self._waiting.pop(k) for k in full]
        for group in groups:
            group[0].wake.put(group)

    def _swap(self, who: Any) -> None:
        if who == self._last:
            return
        now = self._state_type(self._put)
        self._states[self._last], self._last = now, who
        self._put = self._states.pop(who, None) or self._states[None]
        self._put.put(now)

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
                self._leave()

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

    def _draw(self, who: Any, key: Any, value: Any, draw: Callable[[list[Any]], list[Any]]) -> Any:
        mine = _Request(value, draw, self._queue())
        self._leave(key, mine)
        self._lock.release()
        try:
            group = mine.wake.get()
            if group is not None:
                self._draw_group(group)
        finally:
            self._lock.acquire()
            self._swap(who)
        if mine.error is not None:
            raise mine.error
        return mine.result

    def _draw_group(self, group: list[_Request]) -> None:
        error = None
        try:
            results = group[0].draw([r.value for r in group])
        except BaseException as raised:  # Each participant raises it.
            results, error = [None] * len(group), raised
        self.expect(len(group))
        for request, result in zip(group, results):
            request.result, request.error = result, error
        for request in group[1:]:
            request.wake.put(None)

    def finish(self) -> None:
        """Puts the random numbers of the thread that waited back."""
        with self._lock:
            self._swap(None)


def drawing() -> Any:
    """A context in which other threads may take their turns, if the present thread has one."""
    at = getattr(_here, "at", None)
    return contextlib.nullcontext() if at is None else at[0]._drawing(at[1])


def draw_together(key: Any, value: Any, draw: Callable[[list[Any]], list[Any]]) -> Any:
    """Result for a value. `draw` makes the results of many values. If the present thread has a turn, other threads
    take turns meanwhile, and `draw` may get values that they ask for with an equal key."""
    at = getattr(_here, "at", None)
    return draw([value])[0] if at is None else at[0]._draw(at[1], key, value, draw)


def share() -> int | None:
    """How many threads of the CPU the present thread may draw on; None: all."""
    at = getattr(_here, "at", None)
    return None if at is None else at[0].share
