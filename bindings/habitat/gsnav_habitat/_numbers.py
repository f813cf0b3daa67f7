# SPDX-License-Identifier: Apache-2.0
"""States of the generators behind `random` and `numpy.random`, which are exchanged thousands of times per second."""

import ctypes
import functools
import random
import sys
from typing import Any

import numpy as np

_BYTES = 625 * 4  # An MT19937 has 624 words and a position.


@functools.lru_cache(maxsize=None)
def _readable() -> bool:
    """Whether the first bytes of numpy's MT19937 are its whole state."""
    bits = np.random.MT19937(5)
    numbers = np.random.RandomState(bits)
    address = bits.ctypes.state_address
    first, raw = numbers.get_state(), ctypes.string_at(address, _BYTES)
    numbers.random_sample(700)
    ctypes.memmove(address, raw, _BYTES)
    return all(np.array_equal(a, b) for a, b in zip(first, numbers.get_state()))


def _address() -> int:
    """Address of the state behind numpy.random, or 0 if it cannot be read there."""
    bits = np.random.get_bit_generator() if hasattr(np.random, "get_bit_generator") else None
    if type(bits) is not np.random.MT19937 or not _readable():
        return 0
    return int(bits.ctypes.state_address)


@functools.lru_cache(maxsize=None)
def _plain() -> bool:
    """Whether the bytes behind the header of a random.Random are its state, apart from `gauss_next`."""
    if sys.implementation.name != "cpython" or random.Random.__basicsize__ < object.__basicsize__ + _BYTES:
        return False
    numbers = random.Random(5)
    address = id(numbers) + object.__basicsize__
    first, raw = numbers.getstate(), ctypes.string_at(address, _BYTES)
    for _ in range(700):
        numbers.random()
    ctypes.memmove(address, raw, _BYTES)
    return first == numbers.getstate()


def _random() -> Any:
    """The generator behind the functions of `random`, if its state can be read in place."""
    generator = getattr(random.random, "__self__", None)
    return generator if type(generator) is random.Random and _plain() else None


class State:
    """States of both generators at one time."""

    def __init__(self, before: "State | None" = None) -> None:
        """Reads the present states. `before` was put in place last: what did not change is not read again."""
        generator = _random()
        self._random: Any = random.getstate() if generator is None else (
            ctypes.string_at(id(generator) + object.__basicsize__, _BYTES), generator.gauss_next)
        address = _address()
        self._raw = ctypes.string_at(address, _BYTES) if address else b""
        # numpy keeps a normal number for later (index 3), which these bytes do not show.
        known = before is not None and address and before._raw == self._raw and not before._numpy[3]
        self._numpy: Any = before._numpy if before is not None and known else np.random.get_state()

    def put(self, present: "State") -> None:
        """Puts these states in place of the present ones."""
        generator = _random()
        if generator is None:
            random.setstate(self._random)
        else:
            ctypes.memmove(id(generator) + object.__basicsize__, self._random[0], _BYTES)
            generator.gauss_next = self._random[1]
        address = _address()
        if address and self._raw and not self._numpy[3] and not present._numpy[3]:
            ctypes.memmove(address, self._raw, _BYTES)
        else:
            np.random.set_state(self._numpy)
