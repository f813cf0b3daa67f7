#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes docs/reference/command_lines.md of the help texts of the programs.

    tools/make_command_lines.py --build build/dev           writes the page
    tools/make_command_lines.py --build build/dev --check   names differences; exit status 1 if any

A program that the build folder does not have keeps its section of the page; --check does not look at it.
"""
import argparse
import difflib
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "reference" / "command_lines.md"
# (name, path in the build folder, what it is for)
PROGRAMS = (
    ("gsnav-scene", "tools/gsnav-scene", "Makes scenes and people by code alone, so that there is something to read."),
    ("gsnav-render", "tools/gsnav-render", "Draws images of a scene: RGB, alpha and depth."),
    ("gsnav-convert", "tools/gsnav-convert", "Converts, crops, turns and merges scenes of Gaussians."),
    ("gsnav-navmesh", "tools/gsnav-navmesh", "Builds, reads, writes and draws a NavMesh; finds visible sets."),
    ("gsnav-avatar", "tools/gsnav-avatar", "Makes Gaussian avatars and lets them walk."),
    ("gsnav-eval", "tools/gsnav-eval", "Plays episodes by a policy and reports metrics."),
    ("gsnav-replay", "tools/gsnav-replay", "Plays an episode of gsnav-eval again, from any camera."),
    ("gsnav-viewer", "tools/viewer/gsnav-viewer", "Shows a scene in a browser, to walk in it."),
    ("gsnav-report", "bench/report/gsnav-report",
     "Measures speed against error of profiles, sensors and backends; draws a page."),
    ("nav_loop", "examples/nav_loop", "The demo's loop: agents, people, pictures and metrics."),
)
HEAD = """# Command lines

<!-- Made by tools/make_command_lines.py; do not edit. -->

For people who use gsnav's programs. After reading you know every option of every program. Each program
prints the same for `--help`.

| program | what it does |
|---|---|
"""
TAIL = """
## Scene options

One set of options opens a scene in all programs: the group *Scene* of `gsnav-render --help`. A program
in which an option has no effect refuses it and says why. Some options do more in three programs:

| option | gsnav-convert | gsnav-navmesh | gsnav-report |
|---|---|---|---|
| `--scene` | an input; repeatable | a scene, or a NavMesh file | `[NAME=]SCENE[:CAMERAS.json]`; repeatable |
| `--up` | default `keep` | as in all programs | for views from outside |
| `--crop` | keeps the Gaussians in the box | builds the NavMesh in the box | refused |
| `--navmesh` | refused | what to build from | refused |
| `--visible-sets` | refused | the file to write | `[SCENE=]FILE`, another profile |
"""
WIDTH = 105


def helped(path, name, arguments):
    """The help text of a program under its own name, in any folder."""
    done = subprocess.run([name, *arguments, "--help"], executable=str(path), capture_output=True, text=True,
                          timeout=60, check=False)
    if done.returncode != 0:
        sys.exit(f"make_command_lines.py: {path} {' '.join(arguments)} --help ended with {done.returncode}: "
                 f"{(done.stderr or done.stdout).strip()[-300:]}")
    lines = [line.rstrip() for line in done.stdout.strip().split("\n")]
    for line in lines:
        if len(line) > WIDTH:
            sys.exit(f"make_command_lines.py: {name}: over {WIDTH} columns of help: {line.strip()[:60]}...")
    return "\n".join(lines)


def commands_of(text):
    """Names of the subcommands that a help text lists."""
    found = re.search(r"^(?:Subcommands|SUBCOMMANDS|Commands):\n((?:  .*\n?)+)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", found.group(1), re.MULTILINE) if found else []


def section(name, path):
    text = helped(path, name, [])
    out = f"## {name}\n\n```\n{text}\n```\n"
    for command in commands_of(text):
        out += f"\n### {name} {command}\n\n```\n{helped(path, name, [command])}\n```\n"
    return out


def sections_of(page):
    return {m.group(1): m.group(0).rstrip("\n") + "\n"
            for m in re.finditer(r"^## (\S+)\n.*?(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True, help="build folder with the programs")
    parser.add_argument("--check", action="store_true", help="write nothing, name what differs")
    options = parser.parse_args()
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    kept, missing, parts = sections_of(old), [], []
    for name, place, _ in PROGRAMS:
        path = options.build.resolve() / place
        if path.is_file():
            parts.append(section(name, path))
        else:
            missing.append(name)
            parts.append(kept.get(name, ""))
    there = [p for p, part in zip(PROGRAMS, parts) if part]
    head = HEAD + "".join(f"| [{name}](#{name}) | {what} |\n" for name, _, what in there)
    new = head + TAIL + "\n" + "\n".join(part for part in parts if part)
    if missing:
        print(f"make_command_lines.py: not built, left as it is: {', '.join(missing)}", file=sys.stderr)
    if not options.check:
        PAGE.write_text(new, encoding="utf-8")
    elif new != old:
        sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), new.splitlines(True), str(PAGE), "--help"))
        sys.exit("make_command_lines.py: the page is not what the programs print; run it without --check")


if __name__ == "__main__":
    main()
