# SPDX-License-Identifier: Apache-2.0
"""How the programs write files, and name a value of a file that cannot be used. Needs no other package."""

from __future__ import annotations

import contextlib
import os
import pathlib
import reprlib
import tempfile
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def aside(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A path beside `path` to write to. It becomes `path` at the end; after an error, nothing of it is left."""
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    if path.is_dir():
        raise IsADirectoryError(f"{path}: is a folder")
    part = path.with_name(f"part-{path.name}")
    try:
        yield part
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def make_folder(path: pathlib.Path) -> None:
    """Makes a folder if there is none. Raises an OSError if no file can be written there."""
    path.mkdir(parents=True, exist_ok=True)
    tempfile.TemporaryFile(dir=path).close()


def line_of(value: object) -> str:
    """The text of a value, in a line that is not too long."""
    return " ".join(str(value).split())[:300]


def shown(value: Any) -> str:
    """A value of a file in a few words: of an array or tensor, type and shape."""
    if hasattr(value, "dtype") and hasattr(value, "shape"):
        return f"{str(value.dtype).removeprefix('torch.')} {list(value.shape)}"
    return line_of(reprlib.repr(value))


def need(right: bool, field: str, value: Any, what: str) -> None:
    """Raises a ValueError that names a field of a file, unless its value is right."""
    if not right:
        raise ValueError(f"{field} is {shown(value)}, not {what}")
