# SPDX-License-Identifier: Apache-2.0
"""Plays the same actions in forkserver workers and in one process, and prints whether all results agree.

    compare_vector_envs.py STEPS [overrides of habitat-baselines]
"""

import hashlib
import random
import sys
import time

import numpy as np


def play(factory, config, steps):
    """Digest of every result, steps per second, and the ids of the episodes."""
    random.seed(11)
    envs = factory().construct_envs(config)
    digest, episodes = hashlib.sha256(), []
    seen = envs.reset()
    rng = np.random.default_rng(5)

    def add(rows):
        for row in rows:
            for name in sorted(row):
                digest.update(np.ascontiguousarray(row[name]).tobytes())

    add(seen)
    seconds = 0.0
    for _ in range(steps):
        actions = [int(a) for a in rng.choice([0, 1, 1, 1, 2, 3], envs.num_envs, p=[0.05, 0.2, 0.2, 0.15, 0.2, 0.2])]
        start = time.perf_counter()
        for i, action in enumerate(actions):
            envs.async_step_at(i, action)
        rows = [envs.wait_step_at(i) for i in range(envs.num_envs)]
        seconds += time.perf_counter() - start
        add([r[0] for r in rows])
        digest.update(repr([(r[1], r[2], sorted(r[3].items())) for r in rows]).encode())
        episodes.append([e.episode_id for e in envs.current_episodes()])
    count = envs.num_envs
    envs.close()
    return digest.hexdigest(), steps * count / seconds, episodes


if __name__ == "__main__":
    from gsnav.habitat import BatchVectorEnvFactory
    from habitat_baselines.common.habitat_env_factory import HabitatVectorEnvFactory
    from habitat_baselines.config.default import get_config

    settings = get_config("pointnav/ppo_pointnav_example.yaml", sys.argv[2:])
    results = [play(f, settings, int(sys.argv[1])) for f in (HabitatVectorEnvFactory, BatchVectorEnvFactory)]
    print("steps/s of workers and of one process:", *(f"{r[1]:.1f}" for r in results))
    print("episodes agree" if results[0][2] == results[1][2] else "episodes DIFFER", len({*map(str, results[0][2])}))
    print("bits agree" if results[0][0] == results[1][0] else "bits DIFFER")
