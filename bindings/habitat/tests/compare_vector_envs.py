# SPDX-License-Identifier: Apache-2.0
"""Plays the same actions in forkserver workers and in one process, and prints whether all results agree.

    compare_vector_envs.py STEPS [overrides of habitat-baselines]

Workers draw on one thread each. The single process draws on all cores.
"""

import hashlib
import os
import random
import sys
import time

import numpy as np


def processes(pid):
    """Ids of a process and those that it started."""
    found = [pid]
    for thread in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{thread}/children") as file:
            for child in file.read().split():
                found += processes(child)
    return found


def processor_seconds():
    """Seconds that this process and its children computed."""
    total = 0
    for pid in processes(os.getpid()):
        with open(f"/proc/{pid}/stat") as file:
            total += sum(int(x) for x in file.read().rpartition(")")[2].split()[11:13])
    return total / os.sysconf("SC_CLK_TCK")


def memory(root=None):
    """Megabytes of a process (None: this one) and its children. Shared memory is divided by the number of its
    processes."""
    total = 0
    for pid in processes(root or os.getpid()):
        with open(f"/proc/{pid}/smaps_rollup") as file:
            total += next(int(line.split()[1]) for line in file if line.startswith("Pss:"))
    return total / 1024


def play(factory, config, steps):
    """Digest of every result, steps per second, the ids of the episodes, megabytes of the environments, and processor
    seconds per step."""
    random.seed(11)
    before = memory()
    envs = factory().construct_envs(config)
    digest, episodes = hashlib.sha256(), []
    seen = envs.reset()
    rng = np.random.default_rng(5)

    def add(rows):
        for row in rows:
            for name in sorted(row):
                digest.update(np.ascontiguousarray(row[name]).tobytes())

    add(seen)
    seconds = computed = 0.0
    for _ in range(steps):
        actions = [int(a) for a in rng.choice([0, 1, 1, 1, 2, 3], envs.num_envs, p=[0.05, 0.2, 0.2, 0.15, 0.2, 0.2])]
        computed -= processor_seconds()
        start = time.perf_counter()
        for i, action in enumerate(actions):
            envs.async_step_at(i, action)
        rows = [envs.wait_step_at(i) for i in range(envs.num_envs)]
        seconds += time.perf_counter() - start
        computed += processor_seconds()
        add([r[0] for r in rows])
        digest.update(repr([(r[1], r[2], sorted(r[3].items())) for r in rows]).encode())
        episodes.append([e.episode_id for e in envs.current_episodes()])
    count = envs.num_envs
    used = memory() - before
    envs.close()
    return digest.hexdigest(), steps * count / seconds, episodes, used, computed / steps / count


if __name__ == "__main__":
    from gsnav.habitat import BatchVectorEnvFactory
    from habitat_baselines.common.habitat_env_factory import HabitatVectorEnvFactory
    from habitat_baselines.config.default import get_config

    settings = get_config("pointnav/ppo_pointnav_example.yaml", sys.argv[2:])
    cores = os.environ.pop("OMP_NUM_THREADS", None)
    results = []
    for kind, threads in ((HabitatVectorEnvFactory, "1"), (BatchVectorEnvFactory, cores)):
        if threads is not None:
            os.environ["OMP_NUM_THREADS"] = threads
        results.append(play(kind, settings, int(sys.argv[1])))
        os.environ.pop("OMP_NUM_THREADS", None)
    print("steps/s of workers and of one process:", *(f"{r[1]:.1f}" for r in results))
    print("processor ms per step of workers and of one process:", *(f"{1e3 * r[4]:.1f}" for r in results))
    print("MB of workers and of one process:", *(f"{r[3]:.0f}" for r in results))
    print("episodes agree" if results[0][2] == results[1][2] else "episodes DIFFER", len({*map(str, results[0][2])}))
    print("bits agree" if results[0][0] == results[1][0] else "bits DIFFER")
