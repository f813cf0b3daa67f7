# SPDX-License-Identifier: Apache-2.0
"""Journals of gsnav.ray: a header, and then a line of JSON for each episode, in order."""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _task
from ._errors import InvalidArgument
from ._gsnav import EpisodeMetrics


def header(identity: Sequence[Any], episodes: Sequence[_task.Episode], piece: int) -> str:
    """First line of the journal of an evaluation: number of environments, scenes and settings; episodes; piece."""
    if piece < 1:
        raise InvalidArgument(f"piece = {piece}: must be positive")
    environments, scenes, config = identity
    for scene in scenes:
        if not isinstance(scene, (str, os.PathLike)):
            raise InvalidArgument(f"Workers.evaluate: scene = {type(scene).__name__}: a journal needs scenes by name; "
                                  "pass a name or path, or use rollouts()")
    names = [os.fspath(scene) for scene in scenes]
    content = json.dumps([int(environments), names, config, *episodes], default=_task.plain)
    return json.dumps({"journal": "gsnav.ray", "format": 1, "piece": int(piece),
                       "content": hashlib.sha256(content.encode()).hexdigest()})


def lines(path: pathlib.Path, header: str) -> list[str]:
    """Lines of the episodes in a journal, without one that was cut off. Refuses a file that is no such journal."""
    if not path.exists():
        return []
    try:
        text = path.read_text()
    except UnicodeDecodeError as e:
        raise InvalidArgument(f"{path} is not a journal: {e}") from e
    if not text.startswith(header + "\n") and not (header + "\n").startswith(text):
        raise InvalidArgument(f"{path} is of other episodes, scenes, settings or pieces: use another, or remove it")
    return text.split("\n")[1:-1]


def metrics(path: pathlib.Path, lines: Sequence[str]) -> list[EpisodeMetrics]:
    """Metrics of the episodes 0, 1, ... of a journal."""
    read = []
    for i, line in enumerate(lines):
        try:
            row = json.loads(line)
            values = dict[str, Any]((n, np.inf if v is None else v) for n, v in row["metrics"].items())
            if values.keys() != set(_task.METRIC_FIELDS):
                raise ValueError("its metrics are not those of an episode")
            if row["episode"] != i:
                raise ValueError(f"it is of episode {row['episode']}")
            read.append(EpisodeMetrics(**values))
        except (ValueError, KeyError, TypeError, AttributeError) as e:
            raise InvalidArgument(f"{path}: line {i + 2} is not that of episode {i}: {e}") from e
    return read
