#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that programs have one set of scene options: each takes an option, or says why it has no effect.

usage: check_scene_options.py PROGRAM...

The set is the group `Scene` of the help of the first program. It also checks that text for a full disk is an error.
"""
import re
import subprocess
import sys


def run(program, *arguments, out=subprocess.PIPE):
    return subprocess.run([program, *arguments], stdout=out, stderr=subprocess.STDOUT if out == subprocess.PIPE else
                          subprocess.PIPE, text=True, timeout=60, check=False)


def unknown(program, option):
    """Whether the program does not know the option. A missing value ends the program before it does anything."""
    return "there is no option" in run(program, option).stdout


def scene_options(program):
    group = re.search(r"^Scene:\n(.*?)(?:\n\n|\Z)", run(program, "--help").stdout, re.S | re.M)
    return re.findall(r"^  (?:-\w,)?(--[a-z-]+)", group.group(1), re.M) if group else []


def main():
    programs = sys.argv[1:]
    options = scene_options(programs[0])
    wrong = []
    if len(options) < 15 or not {"--scene", "--up", "--navmesh", "--avatars"} <= set(options):
        wrong.append(f"the scene options of {programs[0]} are not found: {options}")
    for program in programs:
        if not unknown(program, "--no-such-option"):
            wrong.append(f"{program} takes --no-such-option")
        wrong += [f"{program} has no {option}" for option in options if unknown(program, option)]
        with open("/dev/full", "w", encoding="utf-8") as full:
            for text in ["--help", "--version"]:
                lost = run(program, text, out=full)
                if lost.returncode != 1 or "No space left" not in lost.stderr:
                    wrong.append(f"{program} {text} >/dev/full: {lost.returncode}, {lost.stderr!r}")
    print("\n".join(wrong) or f"{len(programs)} programs know {len(options)} scene options")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
