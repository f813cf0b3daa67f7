# SPDX-License-Identifier: Apache-2.0
"""Requests of several participants are drawn in one call."""

import functools
import random

import numpy as np
import pytest
from gsnav_habitat import _turns


def play(turns, works):
    """Runs functions of a participant's number."""
    turns.run([(i, functools.partial(work, i)) for i, work in enumerate(works)])


class Drawer:
    """Doubles numbers, and keeps the sizes of its calls."""

    def __init__(self):
        self.sizes = []

    def __call__(self, values):
        self.sizes.append(len(values))
        return [2 * v for v in values]


@pytest.mark.parametrize("together,sizes", [(1, [1] * 6), (2, [2, 2, 2]), (4, [4, 2]), (6, [6]), (99, [6])])
def test_groups_have_the_asked_size_and_each_turn_its_result(together, sizes):
    turns, draw, got = _turns.Turns(1, 1, together), Drawer(), {}

    def work(i):
        got[i] = _turns.draw_together("key", i, draw)

    for _ in range(3):  # A turn of the same participants again.
        draw.sizes.clear()
        play(turns, [work] * 6)
        assert got == {i: 2 * i for i in range(6)}
        assert sum(draw.sizes) == 6 and max(draw.sizes) <= together
        assert draw.sizes == sizes


def test_turns_that_draw_nothing_or_more_often_do_not_block_others():
    turns, draw, got = _turns.Turns(1, 1, 8), Drawer(), {}

    def work(i):
        got[i] = [_turns.draw_together("key", i, draw) for _ in range(i % 3)]

    play(turns, [work] * 8)
    assert got == {i: [2 * i] * (i % 3) for i in range(8)}
    assert draw.sizes == [5, 2]  # First those of all that draw, then the second ones.


def test_keys_are_not_drawn_together():
    turns, draws, got = _turns.Turns(1, 1, 8), [Drawer(), Drawer()], {}

    def work(i):
        got[i] = _turns.draw_together(i % 2, i, draws[i % 2])

    play(turns, [work] * 5)
    assert got == {i: 2 * i for i in range(5)} and [d.sizes for d in draws] == [[3], [2]]


def test_every_turn_of_a_group_raises_its_error():
    turns, raised = _turns.Turns(1, 1, 3), []

    def fail(values):
        raise KeyError(len(values))

    def work(i):
        with pytest.raises(KeyError, match="3"):
            _turns.draw_together("key", i, fail)
        raised.append(i)

    play(turns, [work] * 3)
    assert sorted(raised) == [0, 1, 2]


def test_random_numbers_stay_with_their_turn():
    random.seed(7)
    np.random.seed(8)
    want = [(random.random(), float(np.random.rand())) for _ in range(2)]
    random.seed(7)
    np.random.seed(8)
    turns, got = _turns.Turns(1, 1, 2), {i: [] for i in range(4)}

    def work(i):
        for _ in range(2):
            got[i].append((random.random(), float(np.random.rand())))
            _turns.draw_together("key", i, list)

    play(turns, [work] * 4)
    assert all(numbers == want for numbers in got.values())


def test_without_a_turn_a_request_is_drawn_at_once():
    draw = Drawer()
    assert _turns.draw_together("key", 4, draw) == 8 and draw.sizes == [1]
