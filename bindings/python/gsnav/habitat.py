# SPDX-License-Identifier: Apache-2.0
"""What gsnav adds to habitat-lab and habitat-baselines. Needs both, and the distribution gsnav-habitat.

`avatar_pointnav_config()` is the path of a task configuration for PointNav among people.
`BatchVectorEnvFactory` puts all environments into the process of the trainer:
habitat_baselines.vector_env_factory._target_=gsnav.habitat.BatchVectorEnvFactory
"""

from typing import Any


def avatar_pointnav_config() -> str:
    """Path of a configuration for habitat.get_config: PointNav with the measures and the reward for people."""
    import gsnav_habitat

    return str(gsnav_habitat.config_path("avatar_pointnav.yaml"))


def __getattr__(name: str) -> Any:
    if name not in ("BatchVectorEnv", "BatchVectorEnvFactory"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from gsnav_habitat import vector_env

    return getattr(vector_env, name)
