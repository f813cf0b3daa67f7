# SPDX-License-Identifier: Apache-2.0
"""Compares the frames per second of VectorEnv with those of the C++ batch, in pairs of runs.

    speed.py REFERENCE --side 64 --sensors depth
    speed.py REFERENCE --side 128
    speed.py REFERENCE --side 256 --device cuda
"""

import argparse
import statistics
import subprocess
import time

import numpy as np

import gsnav

DENSITY = 0.3
WARM_UP = 5  # first steps, which allocate memory, are not counted; reference.cpp has the same number


def python_ms(scene, args, copy):
    """Milliseconds per step of VectorEnv after the first ones."""
    episode = gsnav.generate_episodes(scene.navmesh, 1, 1)
    sensors = gsnav.rgbd_sensors(args.side, args.side)[1 if args.sensors == "depth" else 0:]
    images = gsnav.ImageMemory.backend if args.device.startswith("cuda") else gsnav.ImageMemory.host
    envs = gsnav.VectorEnv(args.environments, scene, device=args.device, episodes=episode, copy=copy,
                           config=gsnav.BatchConfig(sensors=sensors, images=images))
    envs.reset(seed=1)
    seconds = 0.0
    for i in range(args.steps):
        actions = 1 + (np.arange(args.environments) + i) % 3
        start = time.perf_counter()
        envs.step(actions)
        seconds += time.perf_counter() - start if i >= WARM_UP else 0
    return 1000 * seconds / (args.steps - WARM_UP)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reference", help="the program gsnav_python_reference")
    parser.add_argument("--environments", type=int, default=256)
    parser.add_argument("--side", type=int, default=64, help="rows and columns of an image")
    parser.add_argument("--sensors", choices=["rgbd", "depth"], default="rgbd")
    parser.add_argument("--device", default="cpu", help="name of a device; on a GPU, images stay there")
    parser.add_argument("--steps", type=int, default=20, help=f"steps of a run, more than {WARM_UP}")
    parser.add_argument("--pairs", type=int, default=5, help="pairs of runs")
    args = parser.parse_args()
    if args.steps <= WARM_UP:
        parser.error(f"--steps {args.steps}: must be more than {WARM_UP}")
    scene = gsnav.default_simulator_scene(people=0, seed=1, density=DENSITY)
    ratios = {True: [], False: []}
    sizes = map(str, (args.environments, args.side, args.steps, DENSITY))
    command = [args.reference, *sizes, args.sensors, args.device]
    for _ in range(args.pairs):
        for copy, results in ratios.items():
            run = subprocess.run(command, check=True, capture_output=True, text=True)
            results.append(float(run.stdout.split()[1]) / python_ms(scene, args, copy))
    for copy, results in ratios.items():
        print(f"{args.device}, {args.environments} environments, {args.side} x {args.side} {args.sensors}, "
              f"copy={copy}: VectorEnv has {100 * statistics.median(results):.1f} % of the C++ frames per second "
              f"({100 * min(results):.1f} to {100 * max(results):.1f})")


if __name__ == "__main__":
    main()
