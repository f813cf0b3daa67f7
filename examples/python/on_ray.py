# SPDX-License-Identifier: Apache-2.0
"""Evaluates a policy on a Ray cluster. usage: on_ray.py [ACTORS [EPISODES]]; writes journal.jsonl, needs ray"""

import sys

try:
    import numpy as np
    import numpy.typing as npt
    import ray  # noqa: F401

    import gsnav
    import gsnav.ray
except ImportError as error:
    sys.exit(f'on_ray.py needs {error.name}; pip install ".[ray]" in the repository installs all that it needs')


def make_policy(envs: gsnav.VectorEnv) -> gsnav.ray.Policy:
    follower = gsnav.GeodesicFollower()

    def policy(observations: dict[str, npt.NDArray[np.float32]], playing: npt.NDArray[np.int64]) -> list[int]:
        return [int(follower.next(envs.simulator.world(e))) for e in range(envs.num_envs)]

    return policy


def main(actors: int = 2, count: int = 24) -> None:
    # [snippet: ray]
    scene = gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto"))
    assert scene.scene.navmesh is not None
    episodes = gsnav.generate_episodes(scene.scene.navmesh, count, 1)
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(32, 32))
    workers = gsnav.ray.Workers("default", actors=actors, environments=4, config=config)
    metrics = workers.evaluate(episodes, make_policy, "journal.jsonl", piece=8)
    workers.close()
    # [/snippet]
    print(f"{len(metrics)} episodes, SPL {gsnav.summarize(metrics).spl:.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
