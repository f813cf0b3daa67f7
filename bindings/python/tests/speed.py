# SPDX-License-Identifier: Apache-2.0
"""Compares the frames per second of VectorEnv with those of the C++ batch, in pairs of runs.

usage: speed.py REFERENCE [ENVIRONMENTS [SIDE [STEPS [PAIRS]]]]; REFERENCE is the program gsnav_python_reference
"""

import statistics
import subprocess
import sys
import time

import numpy as np

import gsnav

DENSITY = 0.3


def python_ms(scene, environments, side, steps, copy):
    """Milliseconds per step of VectorEnv."""
    episode = gsnav.generate_episodes(scene.navmesh, 1, 1)
    envs = gsnav.VectorEnv(environments, scene, device="cpu", episodes=episode, copy=copy,
                           config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(side, side)))
    envs.reset(seed=1)
    seconds = 0.0
    for i in range(steps):
        actions = 1 + (np.arange(environments) + i) % 3
        start = time.perf_counter()
        envs.step(actions)
        seconds += time.perf_counter() - start
    return 1000 * seconds / steps


def main(reference, environments=64, side=64, steps=20, pairs=5):
    scene = gsnav.default_simulator_scene(people=0, seed=1, density=DENSITY)
    ratios = {True: [], False: []}
    for _ in range(pairs):
        for copy, results in ratios.items():
            run = subprocess.run([reference, str(environments), str(side), str(steps), str(DENSITY)], check=True,
                                 capture_output=True, text=True)
            cpp = float(run.stdout.split()[1])
            results.append(cpp / python_ms(scene, environments, side, steps, copy))
    for copy, results in ratios.items():
        print(f"{environments} environments, {side} x {side} RGB-D, copy={copy}: VectorEnv has "
              f"{100 * statistics.median(results):.1f} % of the C++ frames per second "
              f"({100 * min(results):.1f} to {100 * max(results):.1f})")


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
