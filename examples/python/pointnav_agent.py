# SPDX-License-Identifier: Apache-2.0
"""The agent of train_pointnav.py, and its logs."""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import pathlib
import sys
from typing import Any

import numpy as np
import torch
import torch.distributed as dist
from pointnav_curves import plot
from pointnav_files import aside
from pointnav_policy import ACTIONS, HIDDEN, STRIDES
from pointnav_worlds import LEFT, RIGHT, device_of
from torch import Tensor, nn

import gsnav


# [snippet: rows]
class Rows:
    """Memory of a rollout's images, [T + 1][N][H][W][C] per sensor. The simulator draws into row `at`."""

    def __init__(self, images: list[Tensor]) -> None:
        self.images, self.at = images, 0

    def __call__(self, sensor: int, floats: int) -> Tensor:
        return self.images[sensor][self.at]
# [/snippet]


class Mirror:
    """Swaps left and right in every other environment, so that each flat has a mirrored twin, if `on`."""

    def __init__(self, on: bool, first: int, environments: int, device: torch.device) -> None:
        self.of = on & ((first + np.arange(environments)) % 2 == 1)
        self.where = torch.from_numpy(self.of)[:, None, None, None].to(device) if on else None

    def images(self, images: list[Tensor]) -> list[Tensor]:
        """Images [...][N][H][W][C] of each sensor, as the agent sees them."""
        where = self.where
        return images if where is None else [torch.where(where, i.flip(-2), i) for i in images]

    def goals(self, goals: np.ndarray) -> np.ndarray:
        """Goals [N][3] as the agent sees them: their sines, the last numbers, are negated in place."""
        goals[self.of, 2] *= -1
        return goals

    def actions(self, actions: np.ndarray) -> np.ndarray:
        """Actions [N] of the simulator for those of the agent."""
        return np.where(self.of & (actions >= LEFT), LEFT + RIGHT - actions, actions)


class Agent(nn.Module):
    """Three convolutions and a GRU, from an image, goal and last action to the next action and the value."""

    def __init__(self, size: int, channels: int) -> None:
        super().__init__()
        self.shape, self.cnn = (channels, size, size), None
        if channels:
            layers = [nn.Conv2d(channels, 32, 8, STRIDES[0]), nn.Conv2d(32, 64, 4, STRIDES[1]),
                      nn.Conv2d(64, 32, 3, STRIDES[2])]
            self.cnn = nn.Sequential(*(part for layer in layers for part in (layer, nn.ReLU())), nn.Flatten())
            with torch.no_grad():
                if channels != 3:
                    layers[0].weight[:, -1].div_(10.0)  # depth in units of 10 m, without a pass over the images
                length = self.cnn(torch.zeros(1, *self.shape)).shape[1]
            self.image = nn.Sequential(nn.Linear(length, 256), nn.ReLU())
        self.goal, self.last = nn.Linear(3, 32), nn.Embedding(ACTIONS + 1, 32)
        self.gru = nn.GRU(320 if channels else 64, HIDDEN)
        self.policy, self.value = nn.Linear(HIDDEN, ACTIONS), nn.Linear(HIDDEN, 1)
        with torch.no_grad():
            self.policy.weight.mul_(0.01)

    def features(self, images: list[Tensor], goal: Tensor, last: Tensor) -> Tensor:
        """Inputs of the GRU for images [B][H][W][C] of each sensor, goals [B][3] and last actions [B]."""
        parts = [self.goal(goal), self.last(last)]
        if self.cnn is not None:
            c, h, w = self.shape
            seen = images[0] if len(images) == 1 else torch.cat(images, -1)
            rows = seen.view(-1, c, h, w) if c == 1 else seen.view(-1, h, w, c).movedim(-1, 1)
            parts.append(self.image(self.cnn(rows)))
        return torch.cat(parts, -1)

    def heads(self, y: Tensor) -> tuple[Tensor, Tensor]:
        """Logarithms of the actions' probabilities, [B][4], and values, [B]."""
        return torch.log_softmax(self.policy(y), -1), self.value(y)[:, 0]

    def act(self, images: list[Tensor], goal: Tensor, last: Tensor, start: Tensor, hidden: Tensor,
            noise: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Samples actions: actions, their log-probabilities, values and hidden states."""
        last = torch.where(start > 0, ACTIONS, last)
        y, hidden = self.gru(self.features(images, goal, last)[None], (hidden * (1 - start[:, None]))[None])
        log_p, value = self.heads(y[0])
        action = (log_p - torch.log(-torch.log(noise))).argmax(-1)
        return action, log_p.gather(-1, action[:, None])[:, 0], value, hidden[0]


class Reorder(torch.autograd.Function):
    """Rows in another order. The gradient is a gather too, which is deterministic and fast."""

    @staticmethod
    def forward(ctx: Any, rows: Tensor, order: Tensor, inverse: Tensor) -> Tensor:
        ctx.save_for_backward(inverse)
        return rows[order]

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        return gradients[0][ctx.saved_tensors[0]], None, None


def pieces(start: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cuts a chunk at the starts of episodes, bool [L][N], so that a GRU runs over each piece.

    Returns the order of the rows of a PackedSequence, its batch sizes, and for each piece its environment and
    whether it begins with an episode."""
    length, environments = start.shape
    begin = start.copy()
    begin[0] = True
    env, first = np.nonzero(begin.T)
    end = np.append(first[1:], length)
    end[np.append(env[1:] != env[:-1], True)] = length
    longest = np.argsort(first - end, kind="stable")
    env, first, count = env[longest], first[longest], (end - first)[longest]
    sizes = (count[:, None] > np.arange(length)).sum(0)
    sizes = sizes[sizes > 0]
    order = np.concatenate([(first[:n] + k) * environments + env[:n] for k, n in enumerate(sizes)])
    return order, sizes, env, start[first, env]


def clear(noise: Tensor) -> Tensor:
    """Random numbers whose logarithm of the logarithm is finite."""
    return noise.clamp_(1e-9, 1 - 1e-7)


def hash_of(digest: bytes, agent: nn.Module, optimizer: torch.optim.Optimizer) -> str:
    """Hash of a digest, weights and optimiser state."""
    h = hashlib.sha256(digest)
    for group in (agent.state_dict(), *optimizer.state_dict()["state"].values()):
        for name in sorted(group):
            h.update(group[name].detach().cpu().numpy().tobytes())
    return h.hexdigest()[:16]


def devices_of(name: str, rank: int = -1) -> tuple[str, torch.device]:
    """The device of gsnav and the one of torch. With "best" or "cuda", each rank of a host has its own GPU."""
    device = device_of(name)
    if device.kind == gsnav.DeviceKind.cuda and rank >= 0 and name in ("best", "cuda"):
        device = device_of(f"cuda:{rank}")
    if device.kind != gsnav.DeviceKind.cuda:
        return device.name, torch.device("cpu")
    if not torch.cuda.is_available():
        sys.exit(f"--device {device.name}: this torch has no CUDA. Install one that has, or use --device cpu.")
    torch.cuda.set_device(device.index)
    return device.name, torch.device("cuda", device.index)


def set_determinism(on: bool) -> None:
    """Settings of torch, before its first use of a GPU: the same bits in each run, or its fastest algorithms."""
    if on:
        os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # cuBLAS is deterministic with it only
    torch.use_deterministic_algorithms(on)  # also fills new memory
    torch.backends.cudnn.benchmark = not on
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True


def made_by(device: torch.device) -> str:
    """Versions and device. The bits of a run depend on them and on its arguments."""
    threads = torch.get_num_threads()
    name = torch.cuda.get_device_name(device) if device.type == "cuda" else f"a CPU, {threads} threads of torch"
    return f"gsnav {gsnav.__version__} and torch {torch.__version__} on {name}"


def agreed(decision: bool, device: torch.device) -> bool:
    """What rank 0 has decided."""
    if not dist.is_initialized():
        return decision
    there = torch.tensor(float(decision), device=device)
    dist.broadcast(there, 0)
    return bool(there)


def progress(log: list[dict[str, float]], updates: int, rate: float) -> None:
    """Prints a line: means over the episodes of the last ten updates."""
    recent, row = log[-10:], log[-1]
    weight = sum(r["episodes"] for r in recent) or 1
    success, spl = (sum(r[name] * r["episodes"] for r in recent) / weight for name in ("success", "spl"))
    print(f"update {row['update']}/{updates}, {row['frames']:,.0f} steps, {rate:,.0f}/s, success {success:.3f}, "
          f"SPL {spl:.3f}, entropy {row['entropy']:.2f}", end="\r" if sys.stdout.isatty() else "\n", flush=True)


def write_log(out: pathlib.Path, log: list[dict[str, float]]) -> None:
    """Writes log.csv, and its curves as curves.png."""
    with aside(out / "log.csv") as part, open(part, "w", newline="") as file:
        writer = csv.DictWriter(file, log[0].keys())
        writer.writeheader()
        writer.writerows(log)
    try:
        plot({"": log}, (("success", "spl"), ("reward", "entropy")), out / "curves.png")
    except ImportError:
        print("curves.png needs matplotlib, and is left out: pip install matplotlib", file=sys.stderr)
