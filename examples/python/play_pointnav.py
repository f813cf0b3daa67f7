# SPDX-License-Identifier: Apache-2.0
"""Plays held-out episodes with a trained agent, a random policy and the geodesic follower. Needs no torch.

The table has means over the episodes ± standard errors. These are over episodes, not over trainings or flats.

    play_pointnav.py                                     # the agent whose weights are beside this file
    play_pointnav.py --weights run/checkpoint.pt         # the agent that train_pointnav.py --out run has trained
"""

from __future__ import annotations

import argparse
import math
import pathlib
import sys
import time

import numpy as np
from pointnav_policy import ACTIONS, CHANNELS, HIDDEN, Policy, load, save
from pointnav_worlds import (HELD_OUT_SEEDS, METRICS, Worlds, device_of, goals, images_of, number,
                             run_program, sensors_of, world_arguments)

import gsnav

WEIGHTS = pathlib.Path(__file__).with_name("pointnav_depth.npz")


def sensor_of(policy: Policy | None) -> str:
    """Name of the policy's sensor."""
    return next((name for name, c in CHANNELS.items() if policy is not None and c == policy.channels), "depth")


def evaluate(args: argparse.Namespace, worlds: Worlds, name: str, policy: Policy | None) -> dict[str, np.ndarray]:
    """Metrics of each held-out episode, in the order of the episodes.

    name: "agent" samples actions as in training; "greedy" takes the most probable ones; "random" and "follower".
    """
    n = min(args.batch, args.episodes)
    given, playing = [0] * n, [0] * n

    def next_episode(environment: int, count: int) -> gsnav.BatchEpisode:
        playing[environment] = environment + n * given[environment]
        given[environment] += 1
        return worlds.episodes[playing[environment] % int(args.episodes)]

    blind = policy is None or not policy.channels
    simulator = worlds.simulator(args, n, sensors_of(args, blind), next_episode, memory=gsnav.ImageMemory.host)
    follower, rng = gsnav.GeodesicFollower(), np.random.default_rng(args.seed)
    seen, ended, start = simulator.reset(), np.zeros(n, np.bool_), np.ones(n, np.bool_)
    hidden, actions = np.zeros((n, HIDDEN), np.float32), np.zeros(n, np.int64)
    rows: dict[int, np.ndarray] = {}
    shown = time.monotonic()
    while len(rows) < args.episodes:
        if policy is not None:
            log_p, hidden = policy.act(images_of(seen, args, blind), goals(seen), actions, start, hidden)
            noise = rng.gumbel(size=log_p.shape) if name == "agent" else 0
            actions = (log_p + noise).argmax(-1)
        elif name == "random":
            actions = rng.integers(1, ACTIONS, n)
            actions[rng.random(n) < 0.01] = 0
        else:
            actions = np.array([int(follower.next(simulator.world(e))) for e in range(n)])
        played = list(playing)
        seen = simulator.step(actions)
        for e, metrics in zip(seen.finished.tolist(), seen.final_metrics):
            if played[e] < args.episodes:
                rows[played[e]] = metrics
        start, ended = ended, seen.terminated | seen.truncated
        if time.monotonic() - shown > 2 and sys.stderr.isatty():
            shown = time.monotonic()
            print(f"{name}: {len(rows)} of {args.episodes} episodes", end=" \r", file=sys.stderr, flush=True)
    return {key: np.array([rows[i][key] for i in range(args.episodes)], float) for key in METRICS}


def cell(values: np.ndarray) -> str:
    """Mean over the episodes and its standard error, which takes them as independent. One episode has none."""
    error = values.std(ddof=1) / len(values) ** 0.5 if len(values) > 1 else math.nan
    return f"{values.mean():.3f} ± {error:.3f}"


def main() -> None:
    """Prints a table of the policies' metrics: means over the episodes ± their standard errors."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--weights", type=pathlib.Path, default=WEIGHTS, help="checkpoint.pt, or a file of --save-weights")
    p.add_argument("--save-weights", type=pathlib.Path, metavar="FILE.npz", help="write the agent to a file and end")
    p.add_argument("--episodes", type=number(int, 1, 10**6), default=500, help="episodes in flats new to all agents")
    p.add_argument("--batch", type=number(int, 1, 2**16), default=256, help="episodes played at a time")
    p.add_argument("--seed", type=number(int, 0), default=1, help="seed of the actions")
    p.add_argument("--policies", nargs="+", default=["agent", "greedy", "random", "follower"],
                   choices=["agent", "greedy", "random", "follower"], help="rows of the table")
    world_arguments(p)
    args = p.parse_args()
    if args.save_weights is not None and args.save_weights.suffix != ".npz":
        p.error(f"--save-weights {args.save_weights}: the name must end in .npz")
    args.device = device_of(args.device).name
    plays = {"agent", "greedy"} & set(args.policies)
    policy = load(args.weights) if plays or args.save_weights else None
    if policy is not None and args.save_weights:
        return save(policy, args.save_weights)
    args.size = policy.size if policy is not None else 64
    args.sensor = sensor_of(policy)
    worlds = Worlds(HELD_OUT_SEEDS, args, -(-args.episodes // len(HELD_OUT_SEEDS)))
    print("| policy | " + " | ".join(METRICS) + " |\n" + "|---" * (len(METRICS) + 1) + "|")
    for name in args.policies:
        metrics = evaluate(args, worlds, name, policy if name in plays else None)
        print(f"| {name} | " + " | ".join(cell(metrics[key]) for key in METRICS) + " |", flush=True)


if __name__ == "__main__":
    run_program(main)
