# SPDX-License-Identifier: Apache-2.0
"""Spaces and base classes of environments: those of Gymnasium, or small ones of the same shape without it."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ._call_errors import short

if TYPE_CHECKING:
    HAVE_GYMNASIUM = True
else:
    try:
        import gymnasium
        from gymnasium import Env as BaseEnv
        from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete
        from gymnasium.utils.seeding import np_random as make_generator
        from gymnasium.vector import VectorEnv as BaseVectorEnv
        from gymnasium.vector import AutoresetMode

        HAVE_GYMNASIUM = True
    except ImportError:
        HAVE_GYMNASIUM = False

if TYPE_CHECKING or not HAVE_GYMNASIUM:

    class AutoresetMode(enum.Enum):
        """What happens to an environment whose episode has ended, as in Gymnasium."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"

    def make_generator(seed: int | None = None) -> tuple[np.random.Generator, int]:
        """A generator with the numbers of Gymnasium's for the same seed, and the seed."""
        if seed is not None and (isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0):
            raise ValueError(f"seed = {short(seed)}: use an integer >= 0")
        sequence = np.random.SeedSequence(seed)
        entropy: Any = sequence.entropy
        return np.random.Generator(np.random.PCG64(sequence)), int(entropy)

    class _Space:
        """Base of the spaces: a shape, a dtype and a generator for `sample`."""

        def __init__(self, shape: tuple[int, ...] | None, dtype: Any) -> None:
            self.shape = shape
            self.dtype = None if dtype is None else np.dtype(dtype)
            self._generator: np.random.Generator | None = None

        @property
        def np_random(self) -> np.random.Generator:
            """Generator of `sample`."""
            if self._generator is None:
                self.seed(None)
            assert self._generator is not None
            return self._generator

        def seed(self, seed: int | None = None) -> Any:
            """Seeds `sample`."""
            self._generator, used = make_generator(seed)
            return used

        def __contains__(self, x: Any) -> bool:
            return self.contains(x)

        def __eq__(self, other: object) -> bool:
            return type(self) is type(other) and self._key() == other._key()

        def _key(self) -> Any:
            """What equal spaces have in common, beside their type."""
            return self.shape, self.dtype

        def contains(self, x: Any) -> bool:
            """Whether x is a member."""
            raise NotImplementedError

    class Box(_Space):
        """Arrays with bounds for each element."""

        def __init__(self, low: Any, high: Any, shape: tuple[int, ...] | None = None,
                     dtype: Any = np.float32) -> None:
            shape = np.shape(low) if shape is None else shape
            super().__init__(tuple(shape), dtype)
            self.low = np.broadcast_to(np.asarray(low, dtype), shape).copy()
            self.high = np.broadcast_to(np.asarray(high, dtype), shape).copy()

        def _key(self) -> Any:
            return self.shape, self.dtype, self.low.tobytes(), self.high.tobytes()

        def is_bounded(self, manner: str = "both") -> bool:
            """Whether all elements have the bounds "below", "above" or "both"."""
            below, above = bool(np.all(np.isfinite(self.low))), bool(np.all(np.isfinite(self.high)))
            return {"below": below, "above": above, "both": below and above}[manner]

        def contains(self, x: Any) -> bool:
            x = np.asarray(x)
            return bool(x.shape == self.shape and np.can_cast(x.dtype, self.dtype or x.dtype)
                        and np.all(x >= self.low) and np.all(x <= self.high))

        def sample(self) -> Any:
            """A random member; unbounded elements lie within 1 of their bound."""
            low = np.where(np.isfinite(self.low), self.low, 0.0)
            high = np.where(np.isfinite(self.high), self.high, low + 1.0)
            return self.np_random.uniform(low, high).astype(self.dtype)

    class Discrete(_Space):
        """The integers 0 to n - 1."""

        def __init__(self, n: int) -> None:
            super().__init__((), np.int64)
            self.n, self.start = int(n), 0

        def _key(self) -> Any:
            return self.n

        def contains(self, x: Any) -> bool:
            scalar = isinstance(x, np.ndarray) and x.shape == () and x.dtype.kind in "iu"
            return (scalar or isinstance(x, (int, np.integer))) and 0 <= int(x) < self.n

        def sample(self) -> np.int64:
            """A random member."""
            return np.int64(self.np_random.integers(self.n))

    class MultiDiscrete(_Space):
        """Arrays of integers; element i is in 0 to nvec[i] - 1."""

        def __init__(self, nvec: Any) -> None:
            self.nvec = np.array(nvec, np.int64)
            super().__init__(self.nvec.shape, np.int64)

        def _key(self) -> Any:
            return self.nvec.tobytes()

        def contains(self, x: Any) -> bool:
            x = np.asarray(x)
            return bool(x.shape == self.shape and x.dtype.kind in "iu" and np.all(x >= 0)
                        and np.all(x < self.nvec))

        def sample(self) -> Any:
            """A random member."""
            return self.np_random.integers(self.nvec)

    class Dict(_Space):
        """Dictionaries with one space per key."""

        def __init__(self, spaces: Mapping[str, Any]) -> None:
            super().__init__(None, None)
            self.spaces = dict(spaces)

        def _key(self) -> Any:
            return self.spaces

        def __getitem__(self, key: str) -> Any:
            return self.spaces[key]

        def __iter__(self) -> Any:
            return iter(self.spaces)

        def __len__(self) -> int:
            return len(self.spaces)

        def keys(self) -> Any:
            """Names of the spaces."""
            return self.spaces.keys()

        def values(self) -> Any:
            """The spaces."""
            return self.spaces.values()

        def items(self) -> Any:
            """Names and spaces."""
            return self.spaces.items()

        def seed(self, seed: int | None = None) -> Any:
            used = super().seed(seed)
            for space in self.spaces.values():
                space.seed(int(self.np_random.integers(2**31)))
            return used

        def contains(self, x: Any) -> bool:
            return isinstance(x, dict) and x.keys() == self.spaces.keys() and all(
                x[key] in space for key, space in self.spaces.items())

        def sample(self) -> dict[str, Any]:
            """A random member."""
            return {key: space.sample() for key, space in self.spaces.items()}

    class _Base:
        """What Env and VectorEnv of Gymnasium share."""

        metadata: dict[str, Any] = {}
        render_mode: str | None = None
        spec: Any = None
        _np_random: np.random.Generator | None = None
        _np_random_seed: int | None = None

        def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
            """Seeds the generator."""
            if seed is not None:
                self._np_random, self._np_random_seed = make_generator(seed)

        @property
        def np_random(self) -> np.random.Generator:
            """The environment's generator."""
            if self._np_random is None:
                self._np_random, self._np_random_seed = make_generator()
            return self._np_random

        @np_random.setter
        def np_random(self, value: np.random.Generator) -> None:
            self._np_random, self._np_random_seed = value, -1  # -1: unknown, as in Gymnasium

        @property
        def np_random_seed(self) -> int | None:
            """Seed of the environment's generator."""
            self.np_random  # makes the generator
            return self._np_random_seed

        @property
        def unwrapped(self) -> Any:
            """The environment itself."""
            return self

        def has_wrapper_attr(self, name: str) -> bool:
            """Whether the environment has this attribute."""
            return hasattr(self, name)

        def get_wrapper_attr(self, name: str) -> Any:
            """An attribute of the environment."""
            return getattr(self, name)

        def close(self) -> None:
            """Frees the environment."""

        def __enter__(self) -> Any:
            return self

        def __exit__(self, *error: Any) -> None:
            self.close()

    class BaseEnv(_Base):
        """Same shape as gymnasium.Env."""

    class BaseVectorEnv(_Base):
        """Same shape as gymnasium.vector.VectorEnv."""

        num_envs: int
        closed: bool = False

        def close(self, **kwargs: Any) -> None:
            """Frees the environments."""
            if not self.closed:
                self.close_extras(**kwargs)
                self.closed = True

        def close_extras(self, **kwargs: Any) -> None:
            """Frees what a subclass holds."""


def batch_space(space: Any, n: int) -> Any:
    """The space of n members, with a first axis of n."""
    if isinstance(space, Discrete):
        return MultiDiscrete(np.full(n, space.n, np.int64))
    if isinstance(space, Box):
        low = np.repeat(space.low[None], n, axis=0)
        high = np.repeat(space.high[None], n, axis=0)
        return Box(low, high, dtype=space.dtype)
    return Dict({key: batch_space(one, n) for key, one in space.spaces.items()})
