# SPDX-License-Identifier: Apache-2.0
"""Measures the steps per second of train_pointnav.py's environments, without an agent.

    python examples/python/pointnav_speed.py --environments 256 --density 0.05 --quality fast
    python examples/python/pointnav_speed.py --people 5
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

import gsnav
from pointnav_worlds import (TRAIN_SEEDS, Draw, Worlds, device_of, flats_argument, number, run_program,
                             sensor_arguments, sensors_of, world_arguments)


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    world_arguments(p)
    sensor_arguments(p)
    flats_argument(p, "number of flats")
    p.add_argument("--environments", type=number(int, 1, 2**16), default=256, help="number of environments")
    p.add_argument("--steps", type=number(int, 1, 10**6), default=200, help="steps of all environments per run")
    p.add_argument("--runs", type=number(int, 2), default=5, help="number of runs; the first one is not counted")
    p.add_argument("--seed", type=number(int, 0), default=1, help="seed of episodes and actions")
    args = p.parse_args()
    args.device = device_of(args.device).name

    print(f"{args.flats} flats ...", flush=True)
    worlds = Worlds(TRAIN_SEEDS[:args.flats], args, episodes=100)
    simulator = worlds.simulator(args, args.environments, sensors_of(args, args.blind), Draw(worlds, args.seed, 0))
    # Mostly forward, never stop.
    actions = np.random.default_rng(args.seed).choice(
        [int(gsnav.Action.move_forward)] * 2 + [int(gsnav.Action.turn_left), int(gsnav.Action.turn_right)],
        (args.steps, args.environments))
    simulator.reset()
    rates = []
    for _ in range(args.runs):
        begin = time.perf_counter()
        for row in actions:
            simulator.step(row)
        rates.append(args.steps * args.environments / (time.perf_counter() - begin))
    rates = rates[1:]
    print(f"{args.device}: {statistics.median(rates):,.0f} environment steps/s, median of {len(rates)} runs "
          f"({min(rates):,.0f} to {max(rates):,.0f}); {args.environments} environments, {args.people} people per flat, "
          f"{'no images' if args.blind else f'{args.sensor} {args.size}x{args.size}'}, density {args.density}")


if __name__ == "__main__":
    run_program(main)
