# SPDX-License-Identifier: Apache-2.0
"""Journals of gsnav.ray: a header, and then a line of JSON for each episode, in order.

The last field of a line, "crc32", is the CRC-32 of all bytes before its comma, in eight hexadecimal digits. A line
with another one was edited or damaged, and is an error. Other fields are those of a journal of gsnav-eval, which
needs no checksum: it plays the actions of a line again. Journals of format 1 had no checksums and are refused.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import pathlib
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _task
from ._errors import FileNotFound, InvalidArgument
from ._gsnav import EpisodeMetrics


DATASET = ".scene_dataset_config.json"
START = '{"journal": "gsnav.ray", '
FORMAT = 2
FIELDS = {"episode", "id", "reward", "metrics", "actions", "crc32"}  # of a line
SUM = ', "crc32": '
ACTIONS = set(map(str, range(_task.ACTIONS)))


def resolved(scene: Any) -> Any:
    """The absolute path of a scene without symbolic links. "default" and objects are returned as they are."""
    if not isinstance(scene, (str, os.PathLike)) or scene == "default":
        return scene
    file, dataset, inside = str(os.fspath(scene)).partition(DATASET + "#")
    if not dataset:
        return os.path.realpath(file)
    return os.path.realpath(file + DATASET) + "#" + inside


def header(identity: Sequence[Any], episodes: Sequence[_task.Episode], piece: int) -> str:
    """First line of the journal of an evaluation: number of environments, scenes and settings; episodes; piece."""
    environments, scenes, config = identity
    for scene in scenes:
        if not isinstance(scene, (str, os.PathLike)):
            raise InvalidArgument(f"Workers.evaluate: scene = {type(scene).__name__}: a journal needs scenes by name; "
                                  "pass a name or path, or use rollouts()")
    names = [os.fspath(scene) for scene in scenes]
    content = json.dumps([int(environments), names, config, *episodes], default=_task.plain)
    return json.dumps({"journal": "gsnav.ray", "format": FORMAT, "piece": int(piece),
                       "content": hashlib.sha256(content.encode()).hexdigest()})


def lines(path: pathlib.Path, header: str) -> list[str]:
    """Lines of the episodes in a journal, without one that was cut off. Refuses a file that is no such journal."""
    if not path.parent.is_dir():
        raise FileNotFound(f"journal = {path}: there is no folder {path.parent}")
    if not path.exists():
        return []
    if not path.is_file():
        raise InvalidArgument(f"journal = {path}: it is a folder or a device, not a file")
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as e:
        raise InvalidArgument(f"{path} is not a journal: {e}") from e
    version = text.partition("\n")[0].removeprefix(f'{START}"format": ').partition(",")
    if version[1] and version[0].isdecimal() and int(version[0]) != FORMAT:
        raise InvalidArgument(f"{path}: line 1: format = {version[0]}: this gsnav reads {FORMAT}: use another journal")
    if not text.startswith(header + "\n") and not (header + "\n").startswith(text):
        raise InvalidArgument(f"{path} is of other episodes, scenes, settings or pieces: use another, or remove it")
    return text.split("\n")[1:-1]


def begin(path: pathlib.Path, kept: Sequence[str]) -> None:
    """Writes a journal with these lines. A failure leaves the one that was there."""
    part = path.with_name(path.name + ".part")
    if part.is_symlink() or part.exists():  # a process was killed, or it is another file
        text = part.read_text(encoding="utf-8", errors="replace") if part.is_file() and not part.is_symlink() else "?"
        if not text.startswith(START) and not START.startswith(text):
            raise InvalidArgument(f"{part} is in the way and is no journal: move it away")
    part.write_text("\n".join([*kept, ""]), encoding="utf-8")
    part.replace(path)


def _is_finite(values: Sequence[Any]) -> bool:
    return all(v is None or math.isfinite(v) for v in values)


def _sum(text: str) -> str:
    """The checksum of the text of a line before it."""
    return f"{zlib.crc32(text.encode()):08x}"


def line(rollout: Any) -> str:
    """The line of an episode. Infinity is null."""
    metrics = {n: v if np.isfinite(v) else None for n, v in _task.metrics_dict(rollout.metrics).items()}
    reward = sum(rollout.rewards.tolist())
    text = json.dumps({"episode": rollout.episode, "id": rollout.id, "reward": reward if np.isfinite(reward) else None,
                       "metrics": metrics, "actions": "".join(map(str, rollout.actions.tolist()))})[:-1]
    return f'{text}{SUM}"{_sum(text)}"}}'


def _metrics_of(text: str, index: int, id: str) -> EpisodeMetrics:
    """Metrics of a line. A wrong line raises ValueError, or the error of its wrong type."""
    row: Any = json.loads(text)
    if row.keys() != FIELDS:
        raise ValueError(f"its fields are not {', '.join(sorted(FIELDS))}")
    metrics, actions = row["metrics"], row["actions"]
    if metrics.keys() != set(_task.METRIC_FIELDS):
        raise ValueError("its metrics are not those of an episode")
    if type(row["episode"]) is not int or row["episode"] != index:
        raise ValueError(f"it is of episode {row['episode']}")
    if row["id"] != id:
        raise ValueError(f"its id is {row['id']!r}, not {id!r}")
    if not _is_finite([row["reward"], *metrics.values()]):
        raise ValueError("it has a number that is not finite; infinity is null")
    stops = metrics["stop_called"]
    if not isinstance(actions, str) or not ACTIONS.issuperset(actions) or actions.endswith("0") != stops \
            or len(actions) != metrics["steps"] + stops:
        raise ValueError(f"its actions are not those of {metrics['steps']} steps: {actions!r}")
    read = EpisodeMetrics(**dict[str, Any]((n, np.inf if v is None else v) for n, v in metrics.items()))
    before, _, last = text.rpartition(SUM)
    if last != f'"{_sum(before)}"}}':
        raise ValueError(f"its crc32 is {row['crc32']!r}, but its other fields give {_sum(before)!r}: it was edited or "
                         "damaged")
    return read


def metrics(path: pathlib.Path, lines: Sequence[str], episodes: Sequence[_task.Episode]) -> list[EpisodeMetrics]:
    """Metrics of the episodes 0, 1, ... of a journal."""
    read = []
    if len(lines) > len(episodes):
        raise InvalidArgument(f"{path}: line {len(episodes) + 2}: there are only {len(episodes)} episodes")
    for i, text in enumerate(lines):
        episode = _task.without_scene(episodes[i])
        try:
            read.append(_metrics_of(text, i, episode.id))
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as e:
            raise InvalidArgument(f"{path}: line {i + 2} is not that of episode {i}: {e}") from e
    return read
