#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that what a user must not do is refused by a message that says what to do instead.

usage: check_refused.py COMPILER

Under C++17 each public header either compiles, or the first error is that gsnav needs C++20, and the compiler stops
there. The OpenMP backend without its compiled component has to be asked for by name.
"""
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).parents[2]
FOLDERS = [ROOT / "include", *sorted(p.parent for p in (ROOT / "backends").glob("*/gsnav"))]
OPENMP = "gsnav/backends/openmp.hpp"
MOST_LINES = 25  # of a message that is read


def compile_header(compiler, header, *options):
    """The compiler's messages, empty where it takes the header."""
    command = [compiler, "-fsyntax-only", "-fno-diagnostics-color", *options, *(f"-I{d}" for d in FOLDERS),
               "-x", "c++", "-"]
    run = subprocess.run(command, input=f'#include "{header}"\n', stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         text=True, check=False)
    return run.stdout if run.returncode != 0 else ""


def not_refused(text, wanted):
    """Why `text` is not the message that is wanted, or None."""
    errors = re.findall(r"error: (.*)", text)
    if not errors or wanted not in errors[0]:
        return f"the first error is {errors[0] if errors else 'missing'!r}, not {wanted!r}"
    lines = len(text.splitlines())
    return f"{lines} lines of messages, more than {MOST_LINES}" if lines > MOST_LINES else None


def main():
    compiler = sys.argv[1]
    public = [h.relative_to(d).as_posix() for d in FOLDERS for h in sorted((d / "gsnav").rglob("*.hpp"))]
    public = [h for h in public if not h.startswith(("gsnav/detail/", "gsnav/interop/"))]

    def under_17(header):
        text = compile_header(compiler, header, "-std=c++17", "-DGSNAV_OPENMP_COMPILED")
        return not_refused(text, "gsnav needs C++20: compile with -std=c++20") if text else None
    with concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        wrong = [f"{h} under C++17: {why}" for h, why in zip(public, pool.map(under_17, public)) if why]
    if not compile_header(compiler, "gsnav/gsnav.hpp", "-std=c++17"):
        wrong.append("gsnav/gsnav.hpp compiles under C++17")
    why = not_refused(compile_header(compiler, OPENMP, "-std=c++20"), "define GSNAV_OPENMP_HEADER_ONLY")
    if why:
        wrong.append(f"{OPENMP} without the component: {why}")
    print("\n".join(wrong) or f"{len(public)} headers are refused under C++17, {OPENMP} without its component")
    sys.exit(1 if wrong or not public else 0)


if __name__ == "__main__":
    main()
