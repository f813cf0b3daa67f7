# SPDX-License-Identifier: Apache-2.0
"""Participants that take turns on one thread, each with random numbers of its own, while other threads draw for them.

A participant is a greenlet: it runs until it ends or asks for a drawing. To change it takes 2 us. A thread for each
would wait for the interpreter's lock and for its own wake-up at each drawing.
"""

import collections
import threading
from typing import Any, Callable, Iterable

_here = threading.local()


class _Request:
    """A value to draw for a participant, in one call with at most `most` values."""

    def __init__(self, value: Any, draw: Callable[[list[Any]], list[Any]], most: int) -> None:
        self.value, self.draw, self.most = value, draw, most
        self.greenlet: Any = None
        self.who: Any = None
        self.result: Any = None
        self.error: BaseException | None = None


class _Round:
    """Functions of participants, and their errors. A round that is asked for twice runs once."""

    def __init__(self, works: list[tuple[Any, Callable[[], None]]]) -> None:
        self.works, self.done = works, threading.Event()
        self.errors: list[BaseException] = []


class Turns:
    """Participants whose drawings run on at most `drawers` threads, each on `share` threads of the CPU.

    Each participant, and the thread that waits for them, keeps the states of `random` and `numpy.random`, as
    processes do. A new participant begins with those of that thread. `together` is the largest number of requests
    that are drawn in one call.
    """

    def __init__(self, drawers: int, share: int, together: int = 1) -> None:
        # Imported here because habitat_sim, which imports this file, must be light.
        from concurrent.futures import ThreadPoolExecutor
        from queue import SimpleQueue

        from ._numbers import State

        self.share, self._together, self._state_type = share, together, State
        self._rounds: SimpleQueue[Any] = SimpleQueue()
        self._drawn: SimpleQueue[list[_Request]] = SimpleQueue()
        self._threads = ThreadPoolExecutor(drawers, initializer=self._begin_thread)
        self._states: dict[Any, Any] = {}
        self._put: Any = None  # The state that was put in place last.
        self._last: Any = None  # The participant whose random numbers are in place; None: those of all others.
        self._hub: Any = None
        threading.Thread(target=self._serve, daemon=True).start()

    def run(self, works: Iterable[tuple[Any, Callable[[], None]]]) -> None:
        """Runs a function for each participant, any hashable object but None. Returns when all have ended.

        Raises the first error of a function. After Ctrl-C it waits for the functions, too; a second one ends that.
        """
        asked = _Round(list(works))
        try:
            self._rounds.put(asked)
            asked.done.wait()
        except BaseException:  # Ctrl-C may come before the round is asked for, or after its end.
            self._rounds.put(asked)
            asked.done.wait()
            raise
        if asked.errors:
            raise asked.errors[0]

    def close(self) -> None:
        """Ends the threads. Nothing may run."""
        self._rounds.put(None)
        self._threads.shutdown()

    def _begin_thread(self) -> None:
        _here.share = self.share

    def _serve(self) -> None:
        import greenlet

        self._begin_thread()
        _here.turns, self._hub = self, greenlet.getcurrent()
        while (asked := self._rounds.get()) is not None:
            if asked.done.is_set():
                continue
            try:
                self._round(asked, greenlet.greenlet)
                self._swap(None)
            except BaseException as error:  # At exit no drawing can begin. `run` must not wait for it.
                asked.errors.append(error)
            asked.done.set()

    def _round(self, asked: _Round, new: Any) -> None:
        def begin(work: Callable[[], None]) -> None:
            try:
                work()
            except BaseException as error:
                asked.errors.append(error)

        waiting: dict[Any, list[_Request]] = {}
        drawing = 0
        ready: collections.deque[tuple[Any, Any, Callable[[Any], Any]]] = collections.deque(
            (new(begin), who, lambda g, work=work: g.switch(work)) for who, work in asked.works
        )
        while ready or drawing:
            while ready:
                greenlet, who, resume = ready.popleft()
                self._swap(who)
                wish = resume(greenlet)
                if not greenlet.dead:
                    key, request = wish
                    request.greenlet, request.who = greenlet, who
                    waiting.setdefault(key, []).append(request)
                # When no other participant can ask, groups need not wait for more.
                for key in [k for k, g in waiting.items() if not ready or len(g) >= g[0].most]:
                    self._threads.submit(self._draw, waiting.pop(key))
                    drawing += 1
            if drawing:
                for request in self._drawn.get():
                    ready.append((request.greenlet, request.who, _resumed(request)))
                drawing -= 1

    def _draw(self, group: list[_Request]) -> None:
        try:
            results = group[0].draw([r.value for r in group])
            for request, result in zip(group, results):
                request.result = result
        except BaseException as error:  # Each participant raises it.
            for request in group:
                request.error = error
        self._drawn.put(group)

    def _swap(self, who: Any) -> None:
        if who == self._last:
            return
        now = self._state_type(self._put)
        self._states[self._last], self._last = now, who
        self._put = self._states.pop(who, None) or self._states[None]
        self._put.put(now)


def _resumed(request: _Request) -> Callable[[Any], Any]:
    """Goes on with a participant whose request was drawn."""
    if request.error is not None:
        return lambda greenlet: greenlet.throw(request.error)
    return lambda greenlet: greenlet.switch(request.result)


def draw_together(key: Any, value: Any, draw: Callable[[list[Any]], list[Any]]) -> Any:
    """Result for a value. `draw` makes the results of many values. A participant lets others run meanwhile, and `draw`
    may get values that they ask for with an equal key."""
    turns = getattr(_here, "turns", None)
    return draw([value])[0] if turns is None else turns._hub.switch((key, _Request(value, draw, turns._together)))


def draw_alone(draw: Callable[[], Any]) -> Any:
    """Result of a function. A participant lets others run meanwhile."""
    turns = getattr(_here, "turns", None)
    if turns is None:
        return draw()
    request = _Request(None, lambda _: [draw()], 1)
    return turns._hub.switch((request, request))


def share() -> int | None:
    """How many threads of the CPU the present thread may draw on; None: all."""
    return getattr(_here, "share", None)
