# SPDX-License-Identifier: Apache-2.0
"""What train_pointnav.py takes from a checkpoint. A field with a bad value ends the program with a line."""

from __future__ import annotations

import argparse
import io
import math
import pathlib
import sys
from collections.abc import Mapping
from typing import Any

import torch
from pointnav_agent import Agent, made_by
from pointnav_files import aside, line_of, need, shown
from pointnav_policy import CHANNELS, load, read_checkpoint
from pointnav_worlds import METRICS, WORLDS_VERSION
from torch import Tensor

COLUMNS = {"update", "frames", "episodes", *METRICS, "reward", "policy", "value", "entropy", "seconds"}  # of a log
ANEW = "Use another folder for --out, or delete the file to begin anew."


def checkpoint_of(path: pathlib.Path, args: argparse.Namespace, option: str, agent: Agent,
                  names: tuple[str, ...] = ("size", "blind", "sensor"), remedy: str = ANEW) -> dict[str, Any]:
    """Reads a checkpoint and gives the agent its weights. Ends the program if an argument of `names` differs."""
    kept = read_checkpoint(path, remedy)
    for name in names:
        now = getattr(args, name)
        if name not in kept["args"]:
            sys.exit(f"{path}: args[{name!r}] is missing. {remedy}")
        then = kept["args"][name]
        if not isinstance(then, (int, float) if isinstance(now, float) else type(now)):
            sys.exit(f"{path}: args[{name!r}] is {shown(then)}, not of the type of {now!r}. {remedy}")
        if now != then:
            sys.exit(f"--{name.replace('_', '-')} {now}: {path} was trained with {line_of(then)}. Use that, or another "
                     f"{option}.")
    take_weights(agent, kept["agent"], path, remedy)
    return kept


def write_checkpoint(path: pathlib.Path, state: dict[str, Any]) -> None:
    """Writes a checkpoint. Raises an OSError, where torch.save(state, path) has another error for a full disk."""
    held = io.BytesIO()
    torch.save(state, held)
    with aside(path) as part:
        part.write_bytes(held.getbuffer())


def take_weights(agent: Agent, weights: Mapping[str, Tensor], path: pathlib.Path, remedy: str) -> None:
    """Gives the agent the weights that `path` has. Ends the program if they are those of another network."""
    own = agent.state_dict()
    for name in sorted(own.keys() ^ weights.keys()):
        what = "is missing" if name in own else "is none of its weights"
        sys.exit(f"{path}: weights of another network: {shown(name)} {what}. {remedy}")
    try:
        for name, weight in own.items():
            check_numbers(f"agent[{name!r}]", weights[name], weight)
    except ValueError as e:
        sys.exit(f"{path}: {e}. {remedy}")
    agent.load_state_dict(weights)


def check_numbers(name: str, given: Any, own: Tensor, least: float = -math.inf) -> None:
    """Raises a ValueError if a tensor is not like `own`, or has a number that is not finite or below `least`."""
    right = isinstance(given, Tensor) and given.dtype == own.dtype and given.layout == own.layout
    need(right and given.shape == own.shape and given.device.type == "cpu", name, given, shown(own))
    bad = given[~(given.isfinite() & (given >= least))]
    if len(bad):
        what = "finite" if least == -math.inf else f"finite and {least:g} or more"
        raise ValueError(f"{name} has the number {bad[0].item()}, and all must be {what}")


def begin_with(path: pathlib.Path | None, args: argparse.Namespace, agent: Agent) -> None:
    """Gives a new agent the weights of a checkpoint, or of a file .npz, which has none of the value."""
    if path is None:
        return
    remedy = "Name another file by --begin-with."
    if path.suffix.lower() != ".npz":
        checkpoint_of(path, args, "--begin-with", agent, remedy=remedy)
        return
    policy = load(path, "--begin-with")
    sensors = {0: "--blind", **{c: f"--sensor {name}" for name, c in CHANNELS.items()}}
    if (policy.size, policy.channels) != (args.size, agent.shape[0]):
        sensor = sensors.get(policy.channels, f"{policy.channels} channels")
        sys.exit(f"--begin-with {path}: an agent of --size {policy.size} {sensor}. Use these, or another file.")
    weights = {name: w.cpu() for name, w in agent.state_dict().items()}  # the file's are on the CPU too
    weights |= {name: torch.from_numpy(w) for name, w in policy.weights.items()}
    take_weights(agent, weights, path, remedy)


def say_ignored(path: pathlib.Path, kept: dict[str, Any], args: argparse.Namespace) -> None:
    """Says that a run goes on from its own checkpoint, and if it was made by another version or device."""
    if args.begin_with is not None:
        print(f"{path}: goes on from here. --begin-with {args.begin_with} is of no use.", file=sys.stderr)
    now, then = made_by(args.torch_device), kept.get("made_by")
    if then not in (None, now):
        print(f"{path}: made by {then}, goes on by {now}. Bits may differ from those of one run.", file=sys.stderr)


def check_worlds(path: pathlib.Path, kept: dict[str, Any], args: argparse.Namespace) -> None:
    """Ends the program if a checkpoint is of worlds of another version than those that its arguments give now."""
    # A checkpoint without the field is of version 1 or 2. They differ only in the episodes of people.
    then = kept.get("worlds_version", None if args.people else 2)
    if type(then) is not int or then != WORLDS_VERSION:
        sys.exit(f"{path}: worlds_version is {shown(kept.get('worlds_version'))}, not {WORLDS_VERSION}: it may have "
                 f"seen other flats or episodes. Begin anew with its weights: --begin-with {path}, and another folder "
                 "for --out.")


def resumed(path: pathlib.Path, args: argparse.Namespace, agent: Agent, optimizer: torch.optim.Optimizer,
            names: tuple[str, ...]) -> dict[str, Any]:
    """Reads a checkpoint from which training goes on, and gives agent and optimiser their state."""
    kept = checkpoint_of(path, args, "folder for --out", agent, names)
    check_worlds(path, kept, args)
    update, log, digests = kept["update"], kept["log"], kept["digests"]
    try:
        need(type(update) is int and 0 < update < 2**53 and update % args.every == 0, "update", update,
             f"a multiple of --every {args.every}")
        need(isinstance(log, list) and len(log) == update, "log", log, f"a list of {update} rows")
        for number, row in enumerate(log):
            need(isinstance(row, dict) and row.keys() == COLUMNS, f"log[{number}]", row,
                 f"a row of {', '.join(sorted(COLUMNS))}")
            for name, value in row.items():
                right = type(value) in (int, float) and not abs(value) > 2**53
                need(right, f"log[{number}][{name!r}]", value, "a number")
        need(isinstance(digests, list) and len(digests) == args.ranks, "digests", digests, f"a list of {args.ranks}")
        for number, digest in enumerate(digests):
            need(isinstance(digest, bytes) and len(digest) == 32, f"digests[{number}]", digest, "32 bytes")
        need(isinstance(kept.get("made_by"), str | None), "made_by", kept.get("made_by"), "text")
        state, own = checked_state(kept["optimizer"], optimizer), optimizer.state_dict()
    except ValueError as e:
        sys.exit(f"{path}: {e}. {ANEW}")
    optimizer.load_state_dict({**own, "state": state})  # the arguments have made its groups
    return kept


def checked_state(given: Any, optimizer: torch.optim.Optimizer) -> Any:
    """The moments of Adam that a checkpoint has. Raises a ValueError if they are not those of its weights."""
    need(isinstance(given, dict) and given.keys() == {"state", "param_groups"}, "optimizer", given,
         "a dict of 'state' and 'param_groups'")
    groups, own, state = given["param_groups"], optimizer.state_dict()["param_groups"][0], given["state"]
    need(isinstance(groups, list) and len(groups) == 1 and isinstance(groups[0], dict), "optimizer['param_groups']",
         groups, "a list of one dict")
    for name in ("params", "betas", "eps", "weight_decay", "amsgrad", "maximize"):
        value = groups[0].get(name)
        right = type(value) is type(own[name]) and repr(value) == repr(own[name])
        need(right, f"optimizer['param_groups'][0][{name!r}]", value, shown(own[name]))
    weights = optimizer.param_groups[0]["params"]
    need(isinstance(state, dict) and state.keys() == set(range(len(weights))), "optimizer['state']", state,
         f"a dict of the numbers 0 to {len(weights) - 1}")
    for number, weight in enumerate(weights):
        field, values = f"optimizer['state'][{number}]", state[number]
        likes = {"step": (torch.zeros(()), 1.0), "exp_avg": (weight, -math.inf), "exp_avg_sq": (weight, 0.0)}
        need(isinstance(values, dict) and values.keys() == likes.keys(), field, values, f"a dict of {', '.join(likes)}")
        for name, (like, least) in likes.items():
            check_numbers(f"{field}[{name!r}]", values[name], like, least)
    return state
