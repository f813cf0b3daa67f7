# SPDX-License-Identifier: Apache-2.0
"""The trained agent in numpy: the network of pointnav_agent.py, without torch."""

from __future__ import annotations

import os
import pathlib
import sys
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]
STRIDES = (4, 2, 1)  # of the three convolutions
ACTIONS = 4  # stop, forward, left, right
CHANNELS = {"depth": 1, "rgb": 3, "rgbd": 4}  # numbers per pixel of an agent's sensor
HIDDEN = 256  # numbers of a hidden state
LEAST_SIZE, LARGEST_SIZE = 36, 4096  # edge of the images, pixels


def sigmoid(x: Array) -> Array:
    """The logistic function; tanh does not overflow."""
    y: Array = 0.5 + 0.5 * np.tanh(0.5 * x)
    return y


def convolved(x: Array, weight: Array, bias: Array, stride: int) -> Array:
    """Convolution and ReLU: [N][H][W][C] to [N][H'][W'][D], by weights [D][C][K][K]."""
    windows = np.lib.stride_tricks.sliding_window_view(x, weight.shape[2:], (1, 2))[:, ::stride, ::stride]
    n, h, w = windows.shape[:3]
    y: Array = windows.reshape(n * h * w, -1) @ weight.reshape(len(weight), -1).T + bias
    return np.maximum(y, 0).reshape(n, h, w, -1)


class Policy:
    """Chooses actions from images, goal and last action. All numbers are float32."""

    def __init__(self, weights: dict[str, Array], size: int) -> None:
        self.weights, self.size = {name: w.astype(np.float32) for name, w in weights.items()}, size
        self.channels = weights["cnn.0.weight"].shape[1] if "cnn.0.weight" in weights else 0  # 0: a blind agent

    def linear(self, name: str, x: Array) -> Array:
        y: Array = x @ self.weights[f"{name}.weight"].T + self.weights[f"{name}.bias"]
        return y

    def features(self, images: Array | None, goal: Array, last: Array) -> Array:
        parts = [self.linear("goal", goal), self.weights["last.weight"][last]]
        if images is not None and self.channels:
            for layer, stride in enumerate(STRIDES):
                name = f"cnn.{2 * layer}"
                images = convolved(images, self.weights[f"{name}.weight"], self.weights[f"{name}.bias"], stride)
            flat = images.transpose(0, 3, 1, 2).reshape(len(images), -1)
            parts.append(np.maximum(self.linear("image.0", flat), 0))
        return np.concatenate(parts, -1)

    def act(self, images: Array | None, goal: Array, last: Array, start: Array, hidden: Array) -> tuple[Array, Array]:
        """Logarithms of the actions' probabilities, [N][4], and the next hidden states, [N][256].

        images [N][H][W][C], depth in metres; goal [N][3], see goals(); last actions [N]; start [N]: an episode begins.
        """
        none = len(self.weights["last.weight"]) - 1  # stands for the action before the first
        x = self.features(images, goal.astype(np.float32), np.where(start, none, last))
        hidden = hidden * ~start[:, None]
        input_part, hidden_part = (v @ self.weights[f"gru.weight_{k}_l0"].T + self.weights[f"gru.bias_{k}_l0"]
                                   for v, k in ((x, "ih"), (hidden, "hh")))
        (r, z, n), (hidden_r, hidden_z, hidden_n) = np.split(input_part, 3, -1), np.split(hidden_part, 3, -1)
        r, z = sigmoid(r + hidden_r), sigmoid(z + hidden_z)
        hidden = (1 - z) * np.tanh(n + r * hidden_n) + z * hidden
        y = self.linear("policy", hidden)
        y -= y.max(-1, keepdims=True)
        return y - np.log(np.exp(y).sum(-1, keepdims=True)), hidden


def load(path: pathlib.Path) -> Policy:
    """Reads the policy from a file of save(), or from checkpoint.pt of train_pointnav.py, which needs torch.

    Ends the program if the file is none of them, if a weight is not finite, or if weights do not fit each other.
    """
    if not path.exists():
        sys.exit(f"{path}: not found. Train first, or name another file by --weights.")
    try:
        if path.suffix == ".npz":
            with np.load(path) as file:
                weights = {name: file[name] for name in file.files}
            size = int(weights.pop("size"))
        else:
            state = read_checkpoint(path)
            weights, size = {name: w.numpy() for name, w in state["agent"].items()}, int(state["args"]["size"])
        bad = [name for name, w in weights.items() if not np.isfinite(w).all()]
        if bad:
            raise ValueError(f"{bad[0]} is not finite")
        if not LEAST_SIZE <= size <= LARGEST_SIZE:
            raise ValueError(f"size {size} is not between {LEAST_SIZE} and {LARGEST_SIZE}")
        return checked(Policy(weights, size))
    except KeyError as e:
        sys.exit(f"{path}: no weights of an agent: {e} is missing")
    except Exception as e:  # numpy and zipfile document no types for damaged files
        sys.exit(f"{path}: no weights of an agent: {e}")


def read_checkpoint(path: pathlib.Path) -> dict[str, Any]:
    """What train_pointnav.py has saved. Ends the program if the file is no checkpoint."""
    try:
        import torch  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        sys.exit(f"{path}: reading it needs PyTorch: pip install torch")
    try:
        state: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
        missing = [name for name in ("agent", "args", "optimizer", "update", "digests", "log") if name not in state]
    except Exception as e:  # torch documents no type
        sys.exit(f"{path}: no checkpoint of train_pointnav.py, or damaged: {str(e).splitlines()[0] if str(e) else e!r}")
    if missing:
        sys.exit(f"{path}: no checkpoint of train_pointnav.py: {missing[0]!r} is missing")
    return state


def checked(policy: Policy) -> Policy:
    """The policy, if it can act: otherwise a KeyError, IndexError or ValueError."""
    if policy.channels not in (0, *CHANNELS.values()):
        raise ValueError(f"images of {policy.channels} channels are those of no sensor")
    images = np.zeros((1, policy.size, policy.size, policy.channels), np.float32) if policy.channels else None
    start = np.ones(1, np.bool_)
    log_p, _ = policy.act(images, np.zeros((1, 3)), np.zeros(1, np.int64), start, np.zeros((1, HIDDEN), np.float32))
    if log_p.shape != (1, ACTIONS) or len(policy.weights["last.weight"]) != ACTIONS + 1:
        raise ValueError(f"the agent has {log_p.shape[-1]} actions, not {ACTIONS}")
    return policy


def save(policy: Policy, path: pathlib.Path) -> None:
    """Writes the weights as numbers of 16 bits, without those of the value, to a file .npz."""
    kept: dict[str, Any] = {name: w.astype(np.float16) for name, w in policy.weights.items() if name[:5] != "value"}
    aside = path.with_name(path.name + ".tmp")
    with open(aside, "wb") as file:
        np.savez_compressed(file, **kept, size=np.int32(policy.size))
    os.replace(aside, path)
