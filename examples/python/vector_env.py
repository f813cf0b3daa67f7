# SPDX-License-Identifier: Apache-2.0
"""Steps PointNav environments by a random policy. usage: vector_env.py [ENVIRONMENTS [STEPS]]; needs gymnasium"""

import sys

import gymnasium
import numpy as np

import gsnav


def main(environments: int = 4, steps: int = 40) -> None:
    # [snippet: environments]
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(64, 64), task=gsnav.TaskConfig(max_steps=20))
    envs = gymnasium.make_vec("gsnav/PointNav-v0", num_envs=environments, config=config)
    observations, infos = envs.reset(seed=1)  # observations["rgb"]: float32 [4][64][64][3]
    envs.action_space.seed(1)
    spl = []
    for _ in range(steps):
        observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
        if "metrics" in infos:  # some episodes have ended
            spl.extend(infos["metrics"]["spl"][infos["_metrics"]])
    envs.close()
    # [/snippet]
    print(f"{len(spl)} episodes, SPL {np.mean(spl):.2f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
