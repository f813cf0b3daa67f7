# SPDX-License-Identifier: Apache-2.0
"""The trained agent in numpy: the network of pointnav_agent.py, without torch."""

from __future__ import annotations

import pathlib
import re
import sys
import warnings
import zipfile
from typing import Any

import numpy as np
from pointnav_files import aside, line_of, need, shown

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


def shapes(size: int, channels: int) -> dict[str, list[int]]:
    """Shapes of the weights of an agent, without those of its value."""
    out: dict[str, list[int]] = {}
    of, edge = channels, size
    for layer, (to, kernel) in enumerate(((32, 8), (64, 4), (32, 3)) if channels else ()):
        out[f"cnn.{2 * layer}.weight"], out[f"cnn.{2 * layer}.bias"] = [to, of, kernel, kernel], [to]
        of, edge = to, (edge - kernel) // STRIDES[layer] + 1
    rows = {"goal": [32, 3], "policy": [ACTIONS, HIDDEN], **({"image.0": [256, of * edge * edge]} if channels else {})}
    for name, shape in rows.items():
        out[f"{name}.weight"], out[f"{name}.bias"] = shape, shape[:1]
    for name, inputs in (("ih", 320 if channels else 64), ("hh", HIDDEN)):
        out[f"gru.weight_{name}_l0"], out[f"gru.bias_{name}_l0"] = [3 * HIDDEN, inputs], [3 * HIDDEN]
    return {**out, "last.weight": [ACTIONS + 1, 32]}


def load(path: pathlib.Path, option: str = "--weights") -> Policy:
    """Reads the policy from a file of save(), or from checkpoint.pt of train_pointnav.py, which needs torch.

    Ends the program if the file is none of them, if a weight is not finite, or if weights do not fit each other.
    """
    if not path.exists():
        sys.exit(f"{path}: not found. Train first, or name another file by {option}.")
    remedy = f"Name another file by {option}."
    try:
        if path.suffix.lower() == ".npz":
            weights = arrays_of(path)
            size = weights.pop("size")
            need(size.dtype.kind in "iu" and not size.shape, "size", size, "a whole number")
            return checked(weights, int(size))
        state = read_checkpoint(path, remedy)
        return checked({name: w.detach().numpy() for name, w in state["agent"].items()}, state["args"]["size"])
    except KeyError as e:
        sys.exit(f"{path}: no weights of an agent: {e} is missing. {remedy}")
    except Exception as e:  # numpy and zipfile document no types for damaged files
        sys.exit(f"{path}: no weights of an agent: {(line_of(e) or repr(e)).rstrip('.')}. {remedy}")


def arrays_of(path: pathlib.Path) -> dict[str, Array]:
    """The arrays of a file .npz."""
    arrays: dict[str, Array] = {}
    with open(path, "rb") as opened:
        if not zipfile.is_zipfile(opened):
            raise ValueError("it is no file .npz, or only a part of one")
    with np.load(path, allow_pickle=False) as file:
        for name in file.files:
            try:
                arrays[name] = file[name]
            except ValueError as e:
                raise ValueError(f"{name}: {e}") from None
            need(isinstance(arrays[name], np.ndarray), name, arrays[name], "an array")
    return arrays


def read_checkpoint(path: pathlib.Path, remedy: str) -> dict[str, Any]:
    """What train_pointnav.py has saved, of which weights and size are those of an agent.

    Ends the program if the file is no checkpoint, with a line that ends with `remedy`.
    """
    try:
        import torch  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        sys.exit(f"{path}: reading it needs PyTorch: pip install torch")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of kinds of tensors that are refused below
            state: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as e:  # torch documents no type
        said = str(e).split("WeightsUnpickler error:")[-1]  # the text before it advises to run code of the file
        call = re.search(r"GLOBAL (\S+)", said)
        said = re.split(r"(?<=\w)\. |\n", said.strip())[0]
        why = f"it asks for {call[1]}, and no code of a file is run" if call else line_of(said)
        why = "it ends too early" if isinstance(e, EOFError) else why or repr(e)
        sys.exit(f"{path}: no checkpoint of train_pointnav.py, or damaged: {why.rstrip('.')}. {remedy}")
    try:
        need(isinstance(state, dict), "what it holds", state, "a dict")
        for name in ("agent", "args", "optimizer", "update", "digests", "log"):
            if name not in state:
                raise ValueError(f"no checkpoint of train_pointnav.py: {name!r} is missing")
        agent, args = state["agent"], state["args"]
        need(isinstance(agent, dict) and len(agent) > 0, "agent", agent, "a dict of weights")
        for name, w in agent.items():
            need(isinstance(name, str), "a name in agent", name, "text")
            need(isinstance(w, torch.Tensor) and w.dtype == torch.float32 and w.layout == torch.strided
                 and w.device.type == "cpu", f"agent[{shown(name)}]", w, "a dense array of float32")
        need(isinstance(args, dict), "args", args, "a dict")
        need(type(args.get("size")) is int and LEAST_SIZE <= args["size"] <= LARGEST_SIZE, "args['size']",
             args.get("size"), f"a whole number between {LEAST_SIZE} and {LARGEST_SIZE}")
    except ValueError as e:
        sys.exit(f"{path}: {e}. {remedy}")
    return state


def checked(weights: dict[str, Array], size: int) -> Policy:
    """The policy of these weights, if it can act: otherwise a KeyError or ValueError."""
    sees = "cnn.0.weight" in weights or "image.0.weight" in weights
    first, actions = weights["cnn.0.weight"] if sees else np.zeros((0, 0, 0, 0)), weights["policy.bias"]
    if not LEAST_SIZE <= size <= LARGEST_SIZE:
        raise ValueError(f"size {size} is not between {LEAST_SIZE} and {LARGEST_SIZE}")
    need(first.ndim == 4, "cnn.0.weight", first, "four-dimensional")
    channels = first.shape[1]
    if channels not in (0, *CHANNELS.values()):
        raise ValueError(f"images of {channels} channels are those of no sensor")
    if actions.ndim == 1 and len(actions) != ACTIONS:
        raise ValueError(f"policy.bias is {shown(actions)}: the agent has {len(actions)} actions, not {ACTIONS}")
    for name, shape in shapes(size, channels).items():
        w = weights[name]
        need(w.dtype.kind == "f", name, w, "an array of floating-point numbers")
        need(list(w.shape) == shape, name, w, f"of shape {shape}, as for images of {size} x {size} pixels")
        finite = np.isfinite(w) & (np.abs(w) <= np.finfo(np.float32).max)
        if not finite.all():
            raise ValueError(f"{name} is not finite: a weight is {w[~finite][0]}")
    return Policy({name: w for name, w in weights.items() if w.dtype.kind == "f"}, size)


def save(policy: Policy, path: pathlib.Path) -> None:
    """Writes the weights as numbers of 16 bits, without those of the value, to a file .npz.

    Ends the program if a weight is larger than such a number can be.
    """
    kept: dict[str, Any] = {}
    for name, weight in policy.weights.items():
        if name[:5] == "value":
            continue
        largest = float(np.abs(weight).max(initial=0))
        if largest > 65504.0:
            sys.exit(f"{path}: {name} has a weight of size {largest:g}, and numbers of 16 bits end at 65504")
        kept[name] = weight.astype(np.float16)
    with aside(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, **kept, size=np.int32(policy.size))
