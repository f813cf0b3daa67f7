# SPDX-License-Identifier: Apache-2.0
"""Turns of threads: one at a time, with random numbers of their own; drawing overlaps."""

import random
import threading
import time

import numpy as np
import pytest
from gsnav_habitat import _turns


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
        for _ in range(3):
            with turns.turn(i):
                got[i] += numbers(1)
                with _turns.drawing():
                    time.sleep(0.001)
                got[i] += numbers(1)

    threads = [threading.Thread(target=work, args=(i,)) for i in got]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    turns.finish()
    assert all(numbers_of == alone for numbers_of in got.values())
    assert numbers(6) == alone  # The present thread's own were kept.


def test_turns_exclude_each_other_and_few_draw_at_a_time():
    turns, inside, drawing, most = _turns.Turns(drawers=2, share=3), [0], [0], [0]
    guard = threading.Lock()

    def work(i):
        with turns.turn(i):
            for _ in range(20):
                inside[0] += 1
                assert inside[0] == 1 and _turns.share() == 3
                time.sleep(0.0005)
                inside[0] -= 1
                with _turns.drawing():
                    with guard:
                        drawing[0] += 1
                        most[0] = max(most[0], drawing[0])
                    time.sleep(0.002)
                    with guard:
                        drawing[0] -= 1

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most[0] == 2 and _turns.share() is None
    with _turns.drawing():  # Without a turn there is nothing to give away.
        pass


def test_an_error_ends_a_turn():
    turns = _turns.Turns(drawers=1, share=1)
    with pytest.raises(KeyError), turns.turn("a"), _turns.drawing():
        raise KeyError
    with turns.turn("b"), _turns.drawing():
        pass
