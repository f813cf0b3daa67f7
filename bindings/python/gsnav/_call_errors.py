# SPDX-License-Identifier: Apache-2.0
"""Messages for calls whose arguments fit no function of the compiled module."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

LONGEST = 80  # characters of a value
MOST = 12  # values of a message


def short(value: Any) -> str:
    """The value as text of at most 80 characters."""
    try:
        text = repr(value).encode("utf-8", "backslashreplace").decode()  # without surrogates
    except Exception:  # of the caller's own class, or an integer of thousands of digits
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


def owner_of(function: Any) -> tuple[Any, str]:
    """The class that has a method or a property with this function, and the name in it; None and "" without."""
    from . import _gsnav

    for owner in vars(_gsnav).values():
        for name, value in vars(owner).items() if isinstance(owner, type) else ():
            if any(f is function for f in (value, getattr(value, "fget", None), getattr(value, "fset", None))):
                return owner, name
    return None, ""


def about_self(owner: type, name: str, given: Any, made: bool | None) -> str:
    """The mistake in the first argument of a method, or ""."""
    if not issubclass(type(given), owner):  # isinstance would ask the caller's own class.
        return f"{owner.__name__}.{name}: expected a {owner.__name__} as self, got {short(given)}"
    if name in ("__init__", "__setstate__"):
        again = f"{owner.__name__}.{name}: this object has been made already; make another {owner.__name__}"
        return again if made else ""
    if made is False:
        return f"{owner.__name__}.{name}: __init__ of this {owner.__name__} has not been called"
    return ""


def explained(function: Any, arguments: Sequence[Any], keywords: Sequence[str], text: str, made: bool | None) -> str:
    """The message for a call. It has the values of the arguments and the signatures of the function.

    arguments: all values, those of `keywords` last. text: nanobind's message, which has the signatures. made: whether
    the first argument, an object of this module, has been made by __init__; None if it is no such object.
    """
    signatures = re.findall(r"^    \d+\. (.*)$", text, re.MULTILINE)
    names = max((positional(s) for s in signatures), key=len, default=[])
    first = names[:1] == ["self"]  # number of arguments that the caller does not write
    unnamed = len(arguments) - len(keywords)
    names += [f"argument {i + 1 - first}" for i in range(len(names), unnamed)]
    owner, name = owner_of(function)
    if first and owner is not None and unnamed > 0:
        wrong = about_self(owner, name, arguments[0], made)
        if wrong:
            return wrong
    given = [*zip(names, arguments[:unnamed]), *zip(keywords, arguments[unnamed:])][first:]
    values = ", ".join(f"{name[:LONGEST]} = {short(value)}" for name, value in given[:MOST]) or "no arguments"
    if len(given) > MOST:
        values += f" and {len(given) - MOST} more"
    wanted = " or ".join(f"({', '.join(parts(s)[first:])})" for s in signatures).replace("gsnav._gsnav.", "")
    full = f"{owner.__name__}.{name}" if owner is not None else function.__qualname__
    return f"{full.removesuffix('.__init__')}: got {values}; expected {wanted}"
