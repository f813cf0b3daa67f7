# SPDX-License-Identifier: Apache-2.0
"""States of random generators come back as they were, whatever was drawn meanwhile."""

import random

import numpy as np
import pytest
from gsnav_habitat import _numbers

DRAWS = {
    "nothing": lambda: None,
    "python": random.random,
    "python's normal": lambda: random.gauss(0, 1),
    "uniform": np.random.rand,
    "normal": np.random.randn,  # Every second call uses a number that was kept.
    "624 words": lambda: np.random.randint(0, 2**32, 624, dtype=np.uint32),  # The position comes back to its place.
    "seed": lambda: np.random.seed(3),
}


def draws():
    return [random.random(), random.gauss(0, 1), *np.random.randn(3), *np.random.rand(700)]


@pytest.mark.parametrize("raw", [True, False], ids=["bytes", "states"])
@pytest.mark.parametrize("mine", DRAWS)
@pytest.mark.parametrize("others", DRAWS)
def test_a_state_comes_back(mine, others, raw, monkeypatch):
    if not raw:
        monkeypatch.setattr(_numbers, "_address", lambda: 0)
        monkeypatch.setattr(_numbers, "_random", lambda: None)
    kept = random.getstate(), np.random.get_state()
    random.seed(1)
    np.random.seed(2)
    other = _numbers.State()  # That of a second participant, which begins with the same numbers.
    DRAWS[mine]()
    expected = random.getstate(), np.random.get_state()
    want = draws()
    random.setstate(expected[0])
    np.random.set_state(expected[1])
    put = other
    for _ in range(3):  # To and fro. The other one draws each time.
        me = _numbers.State(put)
        other.put(me)
        DRAWS[others]()
        other = _numbers.State(other)
        me.put(other)
        put = me
    assert draws() == want
    random.setstate(kept[0])
    np.random.set_state(kept[1])


def test_bytes_are_used_and_another_generator_is_left_to_numpy():
    assert _numbers._readable() and _numbers._address() and _numbers._random() is random.random.__self__
    usual = np.random.get_bit_generator()
    np.random.set_bit_generator(np.random.PCG64(4))
    try:
        assert _numbers._address() == 0
    finally:
        np.random.set_bit_generator(usual)
