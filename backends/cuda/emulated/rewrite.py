#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Rewrites device code as C++: launches become calls, and dynamic shared memory becomes a pointer. Line
numbers are preserved."""
import argparse
import pathlib
import re
import sys

KERNEL = re.compile(r"[\w:]+\s*$")
SHARED = re.compile(r"extern\s+__shared__\s+(?:__align__\(\d+\)\s+)?([\w ]+?)\s+(\w+)\[\];")
REGISTER = re.compile(r'asm volatile\("" : "\+r"\((\w+)\)\);')


def kernel_begin(text, end):
    """Start of the expression that names a kernel and ends at `end`: names, ::, and template arguments."""
    at = end
    while text[at - 1].isspace():
        at -= 1
    if text[at - 1] == ">":
        depth = 0
        while True:
            at -= 1
            depth += {">": 1, "<": -1}.get(text[at], 0)
            if depth == 0:
                break
    name = KERNEL.search(text, 0, at)
    return name.start()


def closing(text, at):
    """Position after the bracket that closes the one at `at`."""
    depth = 0
    while True:
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
        if depth == 0:
            return at


def rewritten(text):
    at = 0
    while (begin := text.find("<<<", at)) >= 0:
        end = text.index(">>>", begin)
        first = kernel_begin(text, begin)
        kernel, setup = text[first:begin], text[begin + 3:end]
        arguments = text.index("(", end)
        past = closing(text, arguments)
        name = " ".join(kernel.split())
        call = (f'::gsnav::emulated::Launcher("{name}", {setup})([=](const auto&... a) {{ {kernel}(a...); }}, '
                + text[arguments + 1:past])
        text = text[:first] + call + text[past:]
        at = first + len(call)
    text = SHARED.sub(r"\1* const \2 = static_cast<\1*>(::gsnav::emulated::dynamic_shared());", text)
    return REGISTER.sub(r"static_cast<void>(\1);", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    args = parser.parse_args()
    text = rewritten(args.source.read_text())
    if "<<<" in text:
        sys.exit(f"{args.source}: a launch was not understood")
    args.output.parent.mkdir(parents=True, exist_ok=True)
    args.output.write_text(f'#include <cuda_runtime.h>\n#line 1 "{args.source}"\n{text}')


if __name__ == "__main__":
    main()
