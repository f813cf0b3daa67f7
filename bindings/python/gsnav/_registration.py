# SPDX-License-Identifier: Apache-2.0
"""Registers the environments of this package with Gymnasium."""

from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

NAME = "gsnav/PointNav-v0"
ENV, VECTOR_ENV = "gsnav:Env", "gsnav:VectorEnv"


def register() -> None:
    """Makes "gsnav/PointNav-v0" known to gymnasium.make and gymnasium.make_vec."""
    if NAME not in gymnasium.registry:
        gymnasium.register(NAME, entry_point=ENV, vector_entry_point=VECTOR_ENV)


def spec(arguments: dict[str, Any]) -> EnvSpec:
    """Gymnasium's description of an Env with these arguments, which can make it again."""
    return EnvSpec(NAME, entry_point=ENV, vector_entry_point=VECTOR_ENV, kwargs=arguments)
