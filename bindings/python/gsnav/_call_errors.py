# SPDX-License-Identifier: Apache-2.0
"""Messages for calls whose arguments fit no function of the compiled module."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

LONGEST = 80


def short(value: Any) -> str:
    """The value as text of at most 80 characters."""
    try:
        text = repr(value)
    except Exception:  # of the caller's own class
        text = f"a {type(value).__name__}"
    return text if len(text) <= LONGEST else text[:LONGEST - 3] + "..."


def split(arguments: str) -> list[str]:
    """The arguments of a signature, without those between brackets of their own."""
    parts, depth = [""], 0
    for c in arguments:
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += c
    return [part.strip() for part in parts if part.strip()]


def parts(signature: str) -> list[str]:
    """The arguments of a signature, such as "self", "count: int = ..." and "*". Defaults are left out."""
    inside = signature.split("(", 1)[1].rsplit(" ->", 1)[0].rstrip().removesuffix(")")
    return [re.sub(" = .*", " = ...", argument, flags=re.DOTALL) for argument in split(inside)]


def positional(signature: str) -> list[str]:
    """Names of the arguments of a signature that may be given without their names."""
    names = []
    for argument in parts(signature):
        if argument.startswith("*"):
            break
        if argument != "/":
            names.append(re.split("[:=]", argument)[0].strip())
    return names


def explained(function: Any, arguments: Sequence[Any], keywords: Sequence[str], text: str) -> str:
    """The message for a call. It has the values of the arguments and the signatures of the function.

    arguments: all values, those of `keywords` last. text: nanobind's message, which has the signatures.
    """
    signatures = re.findall(r"^    \d+\. (.*)$", text, re.MULTILINE)
    names = max((positional(s) for s in signatures), key=len, default=[])
    first = names[:1] == ["self"]  # number of arguments that the caller does not write
    unnamed = len(arguments) - len(keywords)
    names += [f"argument {i + 1 - first}" for i in range(len(names), unnamed)]
    given = [*zip(names, arguments[:unnamed]), *zip(keywords, arguments[unnamed:])][first:]
    values = ", ".join(f"{name} = {short(value)}" for name, value in given) or "no arguments"
    wanted = " or ".join(f"({', '.join(parts(s)[first:])})" for s in signatures).replace("gsnav._gsnav.", "")
    name = function.__qualname__ or text.split("(", 1)[0]  # A setter has no name.
    return f"{name.removesuffix('.__init__')}: got {values}; expected {wanted}"
