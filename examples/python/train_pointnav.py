# SPDX-License-Identifier: Apache-2.0
"""Trains a PointNav agent from images with DD-PPO, in random flats. Needs torch; --help explains the arguments.

    train_pointnav.py --out run --steps 1e8              # train, or go on from the checkpoint in run/
    torchrun --nproc-per-node 2 train_pointnav.py ...    # one process per GPU

The same arguments give the same bits, also after a run was stopped and resumed. docs/guide/train_an_agent.md explains.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import os
import pathlib
import sys
import time
from collections.abc import Callable
from typing import Any

try:
    import torch
except ImportError:
    sys.exit("train_pointnav.py needs PyTorch: pip install torch")
import numpy as np
import torch.distributed as dist
from pointnav_agent import (Agent, Mirror, Reorder, Rows, agreed, clear, devices_of, hash_of, made_by, pieces,
                            progress, set_determinism, write_log)
from pointnav_checkpoint import begin_with, resumed, say_ignored, write_checkpoint
from pointnav_files import make_folder
from pointnav_policy import ACTIONS, CHANNELS, HIDDEN
from pointnav_worlds import (METRICS, SUCCESS, TRAIN_SEEDS, WORLDS_VERSION, Draw, Worlds, flats_argument, goals,
                             mixed, number, run_program, sensor_arguments, sensors_of, world_arguments)
from torch import Tensor, nn
from torch.nn.utils.rnn import PackedSequence

import gsnav

GAMMA, LAMBDA, CLIP, VALUE_COEF, ENTROPY_COEF, MAX_NORM = 0.99, 0.95, 0.2, 0.5, 0.01, 0.5
# Arguments that a checkpoint keeps: with others, training would not go on as it began.
KEPT = ("seed", "flats", "episodes_per_flat", "people", "blind", "size", "density", "rooms", "environments",
        "rollout", "chunks", "epochs", "lr", "horizon", "every", "cut_off", "ranks", "quality", "success",
        "critic_updates", "sensor", "mirror", "worlds", "not_deterministic", "penalties")


class Learner:
    """Collects rollouts of T steps in N environments and updates the agent by PPO."""

    def __init__(self, args: argparse.Namespace, agent: Agent, optimizer: torch.optim.Adam, worlds: Worlds) -> None:
        self.args, self.agent, self.optimizer, self.worlds = args, agent, optimizer, worlds
        self.device, n, t = next(agent.parameters()).device, args.environments, args.rollout
        self.rank, self.ranks = (dist.get_rank(), dist.get_world_size()) if dist.is_initialized() else (0, 1)
        self.update_count, self.digest = 0, b""
        self.draw = Draw(worlds, args.seed, self.rank * n)
        sensors = sensors_of(args, args.blind)

        def made(*shape: int, dtype: torch.dtype = torch.float32, host: bool = False) -> Tensor:
            pinned = host and self.device.type == "cuda"
            return torch.zeros(*shape, dtype=dtype, device="cpu" if host else self.device, pin_memory=pinned)

        self.images = [made(t + 1, n, *spec.resolution, CHANNELS[spec.uuid]) for spec in sensors]
        self.rows, self.mirror = Rows(self.images), Mirror(args.mirror, self.rank * n, n, self.device)
        self.simulator = worlds.simulator(args, n, sensors, self.draw, self.rows)
        self.goal, self.start = made(t + 1, n, 3), made(t + 1, n)
        self.action, self.log_p, self.values = made(t, n, dtype=torch.int64), made(t, n), made(t + 1, n)
        self.last, self.hidden, self.noise = made(t + 1, n, dtype=torch.int64), made(n, HIDDEN), made(t + 1, n, ACTIONS)
        self.first_hidden = made(args.chunks, n, HIDDEN)
        self.result, self.advantage, self.returns = made(3, t, n), made(t, n), made(t, n)
        self.moments, self.losses = made(3), made(3)
        # On the host: what the simulator returns, and the actions that it takes.
        self.host_goal, self.host_start = made(t + 1, n, 3, host=True), made(t + 1, n, host=True)
        self.host_action = made(n, dtype=torch.int64, host=True)
        self.host_result = made(3, t, n, host=True)  # reward, done, valid
        self.pool = torch.cuda.graph_pool_handle() if self.device.type == "cuda" else None
        self.graphs: dict[tuple[str, int], torch.cuda.CUDAGraph] = {}
        self.clock = 0.0
        self.store: Any = dist.distributed_c10d._get_default_store() if self.ranks > 1 else None
        self.times = dict.fromkeys(("simulate", "act", "learn"), 0.0)

    def run(self, name: str, f: Callable[[int], None], at: int = 0) -> None:
        """Runs f(at), on a GPU as a CUDA graph. A second run of f may change the hidden state only."""
        if self.device.type != "cuda":
            return f(at)
        if (name, at) not in self.graphs:
            hidden = self.hidden.clone()
            f(at)  # lets libraries allocate what they need
            self.hidden.copy_(hidden)
            torch.cuda.synchronize()
            graph = torch.cuda.CUDAGraph()
            with torch.cuda.graph(graph, pool=self.pool):
                f(at)
            self.graphs[name, at] = graph
        self.graphs[name, at].replay()

    def note(self, what: str) -> None:
        """Adds the time since the last note to a row of the table of times."""
        now = time.perf_counter()
        self.times[what] += now - self.clock
        self.clock = now

    def begin(self) -> None:
        """Starts new episodes in all environments. From here on, everything follows from the checkpoint."""
        self.draw.begin(self.update_count)
        self.rows.at = 0
        self.seen, self.ended = self.simulator.reset(), np.zeros(self.args.environments, np.bool_)
        self.hidden.zero_()
        self.last.zero_()
        self.observe(0, np.ones_like(self.ended))

    def observe(self, t: int, start: np.ndarray) -> None:
        """Stores the observations before action t. The simulator has drawn the images in their row."""
        self.host_goal.numpy()[t] = self.mirror.goals(goals(self.seen))
        self.host_start.numpy()[t] = self.starts = start

    def act(self, t: int) -> None:
        """Chooses action t. After the last one, only the value is of use."""
        steps = self.args.rollout
        self.goal[t].copy_(self.host_goal[t], non_blocking=True)
        self.start[t].copy_(self.host_start[t], non_blocking=True)
        if t < steps and t % (steps // self.args.chunks) == 0:
            self.first_hidden[t * self.args.chunks // steps].copy_(self.hidden)
        images = self.mirror.images([i[t] for i in self.images])
        action, log_p, value, hidden = self.agent.act(images, self.goal[t], self.last[t], self.start[t], self.hidden,
                                                      self.noise[t])
        self.values[t].copy_(value)
        if t < steps:
            self.action[t].copy_(action), self.log_p[t].copy_(log_p), self.last[t + 1].copy_(action)
            self.host_action.copy_(action, non_blocking=True)
            self.hidden.copy_(hidden)

    def bootstrap(self, t: int) -> None:
        """The value of the state after the last action."""
        hidden = self.hidden.clone()
        self.act(t)
        self.hidden.copy_(hidden)

    def record(self, seen: gsnav.BatchStep) -> None:
        """Stores the result of a step. The simulator calls it while it draws into row `rows.at`."""
        t, (reward, done, valid), start = self.rows.at, self.host_result.numpy(), self.ended
        # After the end of an episode comes a step without effect, which begins the next episode.
        reward[t - 1], valid[t - 1] = seen.rewards, ~start
        self.seen, self.ended = seen, seen.terminated | seen.truncated
        done[t - 1] = self.ended
        self.observe(t, start)
        self.finished += [seen.final_metrics] if len(seen.finished) else []

    def straggles(self, t: int) -> bool:
        """Whether enough other ranks have finished their rollouts, so that this one ends early."""
        a = self.args
        if self.ranks == 1 or a.cut_off >= 1 or t < a.rollout // 4 or t % 8:
            return False
        return bool(self.store.add(f"done {self.update_count}", 0) >= a.cut_off * self.ranks)

    @torch.no_grad()
    def collect(self) -> np.ndarray:
        """Plays up to T steps. Returns the metrics of the episodes that ended."""
        a, t = self.args, 0
        self.finished: list[np.ndarray] = []
        torch.manual_seed(mixed(a.seed, self.update_count) >> 1)
        noise = torch.rand(a.rollout + 1, self.ranks * a.environments, ACTIONS, device=self.device)
        self.noise.copy_(clear(noise[:, self.rank * a.environments:][:, :a.environments]))
        self.clock = time.perf_counter()
        while t < a.rollout and not self.straggles(t):
            self.run("act", self.act, t)
            if self.device.type == "cuda":
                torch.cuda.current_stream().synchronize()
            self.note("act")
            t += 1
            self.rows.at = t
            self.simulator.step(self.mirror.actions(self.host_action.numpy()), self.record)
            self.note("simulate")
        self.run("bootstrap", self.bootstrap, t)
        self.host_result.numpy()[::2, t:] = self.host_start.numpy()[t + 1:] = 0  # no reward, not valid
        if self.ranks > 1 and a.cut_off < 1:
            self.store.add(f"done {self.update_count}", 1)
        self.used = t
        self.metrics = np.concatenate(self.finished) if self.finished else self.seen.final_metrics
        self.digest = hashlib.sha256(self.digest + self.metrics.tobytes()).digest()
        return self.metrics

    def estimate(self, _: int) -> None:
        """Generalised advantages."""
        self.result.copy_(self.host_result, non_blocking=True)
        reward, done, valid = self.result
        advantage = torch.zeros_like(reward[0])
        for t in reversed(range(self.args.rollout)):
            go = GAMMA * (1 - done[t])
            advantage = valid[t] * (reward[t] + go * self.values[t + 1] - self.values[t] + go * LAMBDA * advantage)
            self.advantage[t].copy_(advantage)
        torch.add(self.advantage, self.values[:-1], out=self.returns)
        torch.stack([valid.sum(), self.advantage.sum(), (self.advantage ** 2).sum()], out=self.moments)

    def normalize(self) -> None:
        """Gives advantages mean 0 and variance 1 over all ranks."""
        count, total, squares = self.moments
        mean = total / count
        deviation = (squares / count - mean ** 2).clamp(min=1e-8).sqrt()
        self.advantage.sub_(mean).div_(deviation)

    def loss(self, chunk: int, order: Tensor, inverse: Tensor, sizes: Tensor, env: Tensor, fresh: Tensor) -> Tensor:
        """Loss of a chunk of time steps, and its parts: policy, value, entropy."""
        length = self.args.rollout // self.args.chunks
        rows = slice(chunk * length, (chunk + 1) * length)

        def row(values: Tensor) -> Tensor:
            return values[rows].reshape(-1)[order]

        last = torch.where(self.start[rows] > 0, ACTIONS, self.last[rows])
        images = self.mirror.images([i[rows] for i in self.images])
        x = self.agent.features(images, self.goal[rows].reshape(-1, 3), last.reshape(-1))
        x = Reorder.apply(x, order, inverse)  # type: ignore[no-untyped-call,unused-ignore]
        hidden = self.first_hidden[chunk][env] * (1 - fresh)[:, None]
        y = self.agent.gru(PackedSequence(x, sizes), hidden[None])[0].data
        policy_learns = self.update_count >= self.args.critic_updates
        log_p, value = self.agent.heads(y if policy_learns else y.detach())
        weight, advantage = row(self.result[2]), row(self.advantage)
        ratio = (log_p.gather(-1, row(self.action)[:, None])[:, 0] - row(self.log_p)).exp()
        policy = -torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage)
        error = 0.5 * (value - row(self.returns)) ** 2
        entropy = -(log_p.exp() * log_p).sum(-1)
        parts = torch.stack([(weight * part).mean() for part in (policy, error, entropy)])
        self.losses += parts.detach()
        loss: Tensor = parts[0] * policy_learns + VALUE_COEF * parts[1] - ENTROPY_COEF * parts[2] * policy_learns
        return loss

    def update(self) -> None:
        """Epochs of PPO over chunks of time steps. Images are not copied, because a chunk of steps is contiguous."""
        self.run("estimate", self.estimate)
        if self.ranks > 1:
            dist.all_reduce(self.moments)
        self.normalize()
        length = self.args.rollout // self.args.chunks
        start = self.host_start.numpy() > 0
        cut = []
        for chunk in range(self.args.chunks):
            order, sizes, env, fresh = pieces(start[chunk * length:(chunk + 1) * length])
            parts = (order, np.argsort(order), env, fresh.astype(np.float32))
            on_device = [torch.from_numpy(p).to(self.device, non_blocking=True) for p in parts]
            cut.append((*on_device[:2], torch.from_numpy(sizes), *on_device[2:]))
        parameters = list(self.agent.parameters())
        frames = self.update_count * self.args.rollout * self.args.environments * self.ranks
        self.optimizer.param_groups[0]["lr"] = self.args.lr * max(0.1, 1 - 0.9 * frames / self.args.horizon)
        self.losses.zero_()
        for _ in range(self.args.epochs):
            for chunk in range(self.args.chunks):
                self.optimizer.zero_grad()
                torch.autograd.backward(self.loss(chunk, *cut[chunk]))
                if self.ranks > 1:
                    gradients = [p.grad for p in parameters if p.grad is not None]
                    flat = torch.cat([g.view(-1) for g in gradients])
                    dist.all_reduce(flat)
                    flat /= self.ranks
                    for g, mean in zip(gradients, torch.split(flat, [g.numel() for g in gradients])):
                        g.copy_(mean.view_as(g))
                nn.utils.clip_grad_norm_(parameters, MAX_NORM)
                self.optimizer.step()
        self.last[0].copy_(self.last[self.used])
        for images in self.images:
            images[0].copy_(images[self.used])
        self.observe(0, self.starts)
        self.update_count += 1
        self.losses /= self.args.epochs * self.args.chunks
        self.note("learn")


def save(learner: Learner, log: list[dict[str, float]], out: pathlib.Path) -> None:
    """Writes the checkpoint, the log and its curves. A file is complete or absent, whenever the program dies."""
    digests: list[Any] = [learner.digest]
    if learner.ranks > 1:
        digests *= learner.ranks
        dist.all_gather_object(digests, learner.digest)
    if learner.rank:
        return
    # resume() reads all of it, and pointnav_checkpoint.py checks it there.
    state = {"agent": learner.agent.state_dict(), "optimizer": learner.optimizer.state_dict(), "log": log,
             "update": learner.update_count, "digests": digests, "made_by": made_by(learner.device),
             "worlds_version": WORLDS_VERSION, "args": {name: getattr(learner.args, name) for name in KEPT}}
    write_checkpoint(out / "checkpoint.pt", state)
    write_log(out, log)


def resume(args: argparse.Namespace, agent: Agent, optimizer: torch.optim.Optimizer) -> dict[str, Any]:
    """The checkpoint from which the run goes on. Empty if there is none: then --begin-with gives the weights."""
    path = args.out / "checkpoint.pt"
    if not path.exists():
        begin_with(args.begin_with, args, agent)
        return {}
    return resumed(path, args, agent, optimizer, KEPT)


def log_row(learner: Learner, frames: float, seconds: float) -> dict[str, float]:
    """A row of the log: the last update of all ranks. `frames` is the number of environment steps before it."""
    m, ranks = learner.metrics, learner.ranks
    sums = torch.tensor([learner.used * learner.args.environments, len(m), *(float(m[name].sum()) for name in METRICS),
                         float(learner.host_result[0].sum()), *learner.losses.tolist()], dtype=torch.float64)
    if ranks > 1:
        sums = sums.to(learner.device)
        dist.all_reduce(sums)
    steps, episodes, *means, reward, policy, value, entropy = sums.tolist()
    row = {"update": learner.update_count, "frames": frames + steps, "episodes": episodes}
    row.update({name: mean / max(episodes, 1) for name, mean in zip(METRICS, means)})
    row.update(reward=reward / steps, policy=policy / ranks, value=value / ranks, entropy=entropy / ranks)
    return {**row, "seconds": seconds}


def train(args: argparse.Namespace, agent: Agent) -> None:
    """Trains until all environments together have taken `args.steps` steps."""
    began = time.perf_counter()
    optimizer = torch.optim.Adam(agent.parameters(), args.lr, eps=1e-5, fused=args.torch_device.type == "cuda")
    kept = resume(args, agent, optimizer)  # refuses a bad file before the flats are made, which takes a while
    worlds = Worlds(TRAIN_SEEDS[:args.flats], args, args.episodes_per_flat, args.success, args.penalties)
    learner = Learner(args, agent, optimizer, worlds)
    log: list[dict[str, float]] = list(kept.get("log", []))
    if kept:
        learner.update_count, learner.digest = kept["update"], kept["digests"][learner.rank]
    if learner.rank == 0:
        if kept:
            say_ignored(args.out / "checkpoint.pt", kept, args)
            write_log(args.out, log)
        print(f"{args.flats} flats made in {time.perf_counter() - began:.0f} s; {learner.update_count} updates done")
    first, ready, steady = 0.0, 0.0, False
    updates = args.every * math.ceil(args.steps / (args.every * args.rollout * args.environments * args.ranks))
    while learner.update_count < updates:
        at = time.perf_counter()
        if learner.update_count % args.every == 0:
            learner.begin()
        learner.collect()
        learner.update()
        log.append(log_row(learner, log[-1]["frames"] if log else 0.0, time.perf_counter() - at))
        if learner.rank == 0 and steady:
            progress(log, updates, (log[-1]["frames"] - first) / (time.perf_counter() - ready))
        if not steady:  # the first update captures graphs: it is no measure of speed
            first, ready, steady = log[-1]["frames"], time.perf_counter(), True
            learner.times = dict.fromkeys(learner.times, 0.0)
        if learner.update_count % args.every == 0:
            save(learner, log, args.out)
            if agreed(time.perf_counter() - began > 60 * args.minutes, learner.device):
                break
    if learner.rank == 0 and steady:
        steps = max(1.0, log[-1]["frames"] - first) / args.environments / args.ranks
        print("\n| part | ms per step of all environments |\n|---|---|")
        print("\n".join(f"| {name} | {1e3 * t / steps:.3f} |" for name, t in learner.times.items()))
    if learner.rank == 0:
        print(f"hash {hash_of(learner.digest, agent, learner.optimizer)}")


def arguments() -> argparse.Namespace:
    """Reads the command line."""
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--out", type=pathlib.Path, default="pointnav", help="folder of checkpoint, log and curves")
    p.add_argument("--steps", type=number(float, 0, 1e15), default=1e8, help="environment steps, up to a checkpoint")
    p.add_argument("--begin-with", type=pathlib.Path, help="take the weights of a checkpoint.pt or FILE.npz")
    p.add_argument("--minutes", type=number(float, 0), default=math.inf, help="end at the first checkpoint after that")
    p.add_argument("--seed", type=number(int, 0, 2**32 - 1), default=1, help="seed of weights, episodes and actions")
    flats_argument(p, "flats to train in")
    p.add_argument("--episodes-per-flat", type=number(int, 1, 10**6), default=1000, help="episodes to draw from")
    p.add_argument("--environments", type=number(int, 1, 2**16), default=256, help="environments per rank")
    p.add_argument("--rollout", type=number(int, 1, 10**5), default=128, help="steps per update")
    p.add_argument("--chunks", type=number(int, 1, 10**5), default=4, help="minibatches: parts of a rollout in turn")
    p.add_argument("--epochs", type=number(int, 1, 1000), default=3, help="passes over a rollout")
    p.add_argument("--lr", type=number(float, 0, 1), default=1e-3, help="learning rate of Adam at the beginning")
    p.add_argument("--critic-updates", type=number(int, 0), default=0, help="first updates, which learn values alone")
    p.add_argument("--horizon", type=number(float, 1, 1e15), default=1e8, help="steps until the rate is --lr / 10")
    p.add_argument("--every", type=number(int, 1, 10**9), default=50, help="updates from one checkpoint to the next")
    p.add_argument("--cut-off", type=number(float, 0.01, 1), default=1.0, help="fraction of ranks whose end ends the "
                   "rollouts of the others: 0.6 in DD-PPO, and 0.5 for two ranks. Below 1, runs are not reproducible")
    p.add_argument("--mirror", action="store_true", help="swap left and right in every other environment")
    p.add_argument("--not-deterministic", action="store_true", help="let PyTorch choose algorithms by speed alone")
    p.add_argument("--success", type=number(float, 0, 1e6), default=SUCCESS, help="reward for a success")
    p.add_argument("--penalties", type=number(float, 0, 1e3), default=1.0, help="factor on the penalties near people")
    world_arguments(p)
    sensor_arguments(p)
    a = p.parse_args()
    if a.rollout % a.chunks:
        p.error(f"--rollout {a.rollout} must be a multiple of --chunks {a.chunks}")
    if a.begin_with is not None and not a.begin_with.exists():
        p.error(f"--begin-with {a.begin_with}: not found; name a checkpoint.pt or a file .npz")
    return a


def main() -> None:
    """Trains or evaluates."""
    args = arguments()
    local = int(os.environ.get("LOCAL_RANK", -1))
    args.device, args.torch_device = devices_of(args.device, local)
    set_determinism(not args.not_deterministic)
    if local >= 0:
        dist.init_process_group("nccl" if args.torch_device.type == "cuda" else "gloo")
    args.ranks = dist.get_world_size() if local >= 0 else 1
    make_folder(args.out)
    torch.manual_seed(args.seed)
    train(args, Agent(args.size, 0 if args.blind else CHANNELS[args.sensor]).to(args.torch_device))
    if local >= 0:
        dist.destroy_process_group()


if __name__ == "__main__":
    run_program(main)
