# SPDX-License-Identifier: Apache-2.0
"""Participants take turns on one thread, with random numbers of their own; their drawings overlap."""

import functools
import random
import signal
import threading
import time

import numpy as np
import pytest
from gsnav_habitat import _turns


def play(turns, work, count):
    """Runs a function of a participant's number."""
    turns.run([(i, functools.partial(work, i)) for i in range(count)])


def test_random_numbers_are_those_of_separate_processes():
    def numbers(count):
        return [(random.random(), float(np.random.rand())) for _ in range(count)]

    random.seed(7)
    np.random.seed(8)
    alone = numbers(6)
    random.seed(7)
    np.random.seed(8)
    turns, got = _turns.Turns(drawers=2, share=1), {i: [] for i in range(4)}

    def work(i):
        got[i] += numbers(1)
        _turns.draw_alone(lambda: time.sleep(0.001))
        got[i] += numbers(1)

    for _ in range(3):
        play(turns, work, 4)
    assert all(numbers_of == alone for numbers_of in got.values())
    assert numbers(6) == alone  # The present thread's own were kept.
    turns.close()


def test_one_runs_at_a_time_and_few_draw_at_a_time():
    turns, inside, drawing, most, guard = _turns.Turns(drawers=2, share=3), [0], [0], [0], threading.Lock()

    def draw():
        assert _turns.share() == 3
        with guard:
            drawing[0] += 1
            most[0] = max(most[0], drawing[0])
        time.sleep(0.002)
        with guard:
            drawing[0] -= 1
        return drawing

    def work(i):
        for _ in range(20):
            inside[0] += 1
            assert inside[0] == 1 and _turns.share() == 3
            time.sleep(0.0005)
            inside[0] -= 1
            assert _turns.draw_alone(draw) is drawing

    play(turns, work, 4)
    assert most[0] == 2 and _turns.share() is None
    assert _turns.draw_alone(lambda: 5) == 5  # Without participants it is drawn at once.


def test_an_error_ends_a_participant_and_is_raised():
    turns, ended = _turns.Turns(drawers=1, share=1), []

    def fail():
        raise KeyError("a")

    def work(i):
        if i == 1:
            _turns.draw_alone(fail)
        _turns.draw_alone(lambda: None)
        ended.append(i)

    with pytest.raises(KeyError, match="a"):
        play(turns, work, 3)
    assert ended == [0, 2]
    play(turns, lambda i: ended.append(i), 2)
    assert ended == [0, 2, 0, 1]


def test_ctrl_c_waits_for_the_participants():
    turns, ended = _turns.Turns(drawers=1, share=1), []

    def work(i):
        if i == 0:
            signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        _turns.draw_alone(lambda: time.sleep(0.1))
        ended.append(i)

    usual = signal.signal(signal.SIGINT, signal.default_int_handler)  # A shell's background jobs ignore it.
    try:
        with pytest.raises(KeyboardInterrupt):
            play(turns, work, 2)
    finally:
        signal.signal(signal.SIGINT, usual)
    assert ended == [0, 1]


def test_ctrl_c_at_the_end_of_a_round():
    """It may come before or after the waiting thread has seen the end, which is not waited for again."""
    turns, ended = _turns.Turns(drawers=1, share=1), []

    def work(i):
        ended.append(i)
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)

    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for i in range(1000):
            with pytest.raises(KeyboardInterrupt):
                play(turns, work, 1)
            assert len(ended) == i + 1
    finally:
        signal.signal(signal.SIGINT, usual)


def test_closing_ends_the_threads():
    before = threading.active_count()
    turns = _turns.Turns(drawers=3, share=1)
    play(turns, lambda i: _turns.draw_alone(lambda: None), 8)
    assert threading.active_count() > before
    turns.close()
    deadline = time.monotonic() + 10
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before


def test_an_error_of_the_threads_is_raised():
    turns = _turns.Turns(drawers=1, share=1)
    turns._threads.shutdown()  # As at the exit of Python.
    with pytest.raises(RuntimeError, match="shutdown"):
        play(turns, lambda i: _turns.draw_alone(lambda: None), 2)
    ended = []
    play(turns, ended.append, 2)  # They need no drawing.
    assert ended == [0, 1]
