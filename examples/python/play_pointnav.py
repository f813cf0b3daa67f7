# SPDX-License-Identifier: Apache-2.0
"""Plays held-out episodes with the agent of a checkpoint, a random policy and the geodesic follower. Needs torch.

    play_pointnav.py --out run                           # the agent that train_pointnav.py --out run has trained
"""

from __future__ import annotations

import argparse
import pathlib
import sys
from typing import Any

import numpy as np

try:
    import torch
except ImportError:
    sys.exit("play_pointnav.py needs PyTorch: pip install torch")
from pointnav_agent import ACTIONS, HELD_OUT_SEEDS, METRICS, Agent, Worlds
from pointnav_agent import clear, device_of, goals, mixed, world_arguments
from torch.utils.dlpack import from_dlpack

import gsnav


def evaluate(args: argparse.Namespace, worlds: Worlds, policy: str, agent: Agent | None) -> dict[str, float]:
    """Mean metrics over the held-out episodes.

    policy: "agent" samples actions as in training; "greedy" takes the most probable ones; "random" and "follower".
    """
    n, device = min(256, args.episodes), args.torch_device
    given, playing = [0] * n, [0] * n

    def next_episode(environment: int, count: int) -> gsnav.BatchEpisode:
        playing[environment] = environment + n * given[environment]
        given[environment] += 1
        return worlds.episodes[playing[environment] % int(args.episodes)]

    simulator = worlds.simulator(args, n, agent is not None and not args.blind, next_episode)
    follower, rng = gsnav.GeodesicFollower(), np.random.default_rng(args.seed)
    torch.manual_seed(mixed(args.seed, 1))
    seen, ended, start = simulator.reset(), np.zeros(n, np.bool_), np.ones(n, np.bool_)
    hidden, last = torch.zeros(n, 256, device=device), torch.zeros(n, dtype=torch.int64, device=device)
    rows: dict[int, Any] = {}
    while len(rows) < args.episodes:
        if agent is not None:
            goal = torch.tensor(goals(seen), dtype=torch.float32)
            image = seen.on_backend.get("depth", None)
            depth = (from_dlpack(image) if image is not None else
                     torch.from_numpy(seen.images["depth"].copy()) if "depth" in seen.images else hidden)
            with torch.no_grad():
                noise = clear(torch.rand(n, ACTIONS, device=device))
                if policy == "greedy":
                    noise.fill_(0.5)
                last, _, _, hidden = agent.act(depth, goal.to(device), last, torch.tensor(start).float().to(device),
                                               hidden, noise)
            actions = last.cpu().numpy()
        elif policy == "random":
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
    return {name: float(np.mean([rows[i][name] for i in sorted(rows)])) for name in METRICS}


def main() -> None:
    """Prints a table of the policies' metrics."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--out", type=pathlib.Path, default="pointnav", help="folder of the checkpoint")
    p.add_argument("--episodes", type=int, default=500, help="number of episodes in flats that no agent was trained in")
    p.add_argument("--seed", type=int, default=1, help="seed of the actions")
    p.add_argument("--policies", nargs="+", default=["agent", "greedy", "random", "follower"],
                   choices=["agent", "greedy", "random", "follower"], help="rows of the table")
    world_arguments(p)
    args = p.parse_args()
    path = args.out / "checkpoint.pt"
    plays = {"agent", "greedy"} & set(args.policies)
    if plays and not path.exists():
        sys.exit(f"{path}: not found. Train first, or name the folder of a checkpoint by --out.")
    args.device, args.torch_device = device_of(args.device)
    agent = None
    if plays:
        kept = torch.load(path, map_location="cpu", weights_only=True)
        args.blind, args.size = kept["args"]["blind"], kept["args"]["size"]
        agent = Agent(args.size, args.blind).to(args.torch_device)
        agent.load_state_dict(kept["agent"])
    worlds = Worlds(HELD_OUT_SEEDS, args, -(-args.episodes // len(HELD_OUT_SEEDS)))
    print("| policy | " + " | ".join(METRICS) + " |\n" + "|---" * (len(METRICS) + 1) + "|")
    for policy in args.policies:
        means = evaluate(args, worlds, policy, agent if policy in plays else None)
        print(f"| {policy} | " + " | ".join(f"{means[name]:.3f}" for name in METRICS) + " |", flush=True)


if __name__ == "__main__":
    main()
