#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that all programs answer a wrong command line alike: exit status 2, before any work.

usage: check_usage.py FOLDER PROGRAM...

Wrong are names of outputs in formats that nothing writes, boxes with their corners in the wrong order, and values that
a program has no use for. Every option with a number is given values that are no number, not finite, or too large.
A name that is a folder has exit status 1, and is found before the scene is opened.
"""
import os
import re
import shutil
import subprocess
import sys

# Program: arguments, and what the message must say. No file that they name exists.
WALK = "walk --avatar a.npz --flat --clip c.bvh --from 0,0,0 --to 1,0,0 "
STRIP = "strip --avatar a.npz --driver d.npz --eye 0,1,2 --target 0,1,0 "
USAGE = {
    "gsnav-render": [
        ("none.ply --out o --eye 1 1 1 --target 1 1 1", "--eye and --target"),
        ("none.ply --out o --eye nan 1 1 --target 1 1 1", "--eye: nan: must be finite"),
        ("none.ply --out o --depth-near 2 --depth-far 1", "--depth-near must be below --depth-far"),
        ("none.ply --out o --depth-near 2", "--depth-far"),
        ("none.ply --out o --visible-sets auto", "--visible-sets: sampled"),
        ("none.ply --out o --depth first:0x1p-1", "--depth first:0x1p-1: use"),
        ("none.ply --out= --orbit 1", "--out= has no value"),
        ("none.ply --out o --orbit 4 --eye 1 1 1 --target 0 0 0", "--orbit"),
        ("none.ply --out o --cell-size 0", "--cell-size: 0: must be positive"),
        ("none.ply --out o --cell-size 0.1", "--cell-size: there is no NavMesh; give --navmesh or --avatars"),
    ],
    "gsnav-convert": [
        ("none.ply out.xyz", "out.xyz: unknown kind of file to write: use .ply"),
        ("none.ply out", "out: unknown kind of file to write"),
        ("none.ply out.ply --rotate 0 0 0 90", "--rotate: the axis is zero"),
        ("none.ply out.ply --scale nan", "--scale"),
        ("none.ply out.ply --translate nan 0 0", "--translate"),
        ("none.ply out.ply --max-scale -1", "--max-scale"),
        ("none.ply out.ply --level -1", "--level"),
    ],
    "gsnav-scene": [
        ("flat --out a.xyz", "a.xyz: unknown kind of file to write: use .ply"),
        ("flat --out a.ply --mesh a.stl", "--mesh: a.stl: unknown kind of file to write: use .obj"),
        ("flat --out a.ply --cameras c.txt", "--cameras: c.txt: unknown kind of file to write: use .json"),
        ("rooms --out a.xyz", "a.xyz: unknown kind of file to write"),
        ("default --out a.xyz", "a.xyz: unknown kind of file to write"),
        ("default --out a --mesh a/flat.ply", "a/flat.ply: unknown kind of file to write"),
        ("humanoid --out a.fbx", "a.fbx: unknown kind of file to write"),
        ("flat --out a.ply --seed -1", "must not be negative"),
        ("flat --out a.ply --seed 18446744073709551616", "is too large"),
    ],
    "gsnav-navmesh": [
        ("none.ply --out a.ply", "--out: a.ply: unknown kind of file to write: use .navmesh or .bin"),
        ("none.ply --settings-out s.txt", "--settings-out: s.txt: unknown kind of file to write: use .json"),
        ("none.ply --obj a.ply", "--obj: a.ply: unknown kind of file to write: use .obj"),
        ("none.ply --png a.jpg", "--png: a.jpg: unknown kind of file to write: use .png"),
        ("none.ply --agent-radius -1", "agent_radius"),
        ("none.ply --sigmas 0", "sigmas"),
        ("none.ply --object m.obj@1,2,3,", "--object"),
        ("none.ply --visible-sets a.vis --visible-rows 5", "rows"),
    ],
    "gsnav-eval": [
        ("none.ply --navmesh none", "--navmesh: none: agents need one"),
        ("none.ply --storage packed", "--storage: packed: journals"),
        ("none.ply --pictures -5", "--pictures: Value -5 not in range"),
    ],
    "gsnav-viewer": [("none.ply --navmesh none", "--navmesh: none: agents need one")],
    "nav_loop": [
        ("none.ply --navmesh none", "--navmesh: none: agents need one"),
        ("none.ply --storage packed", "--storage: packed: maps"),
    ],
    "gsnav-replay": [
        ("--out none --video v.gif", "--video: v.gif: unknown kind of file to write: use .webp or .mp4"),
        ("--out none --eye 1 1 1 --target 1 1 1", "--eye and --target"),
        ("--out none --first 3 --last 2", "--first"),
    ],
    "gsnav-report": [
        ("none.ply --docs page.html", "--docs: page.html: unknown kind of file to write: use .md"),
        ("=none.ply", "--scene =none.ply: use [NAME=]SCENE"),
        ("none.ply --knob-values foo", "--knob-values foo: no knob has this value"),
        ("none.ply --sizes 64x64,", "--sizes: 64x64,: an element is empty"),
        ("none.ply --sizes=64x64,,32x32 --views 1", "--sizes: 64x64,,32x32: an element is empty"),
        ("none.ply --kinds ,render", "--kinds: ,render: an element is empty"),
    ],
    "gsnav-avatar": [
        ("from-gltf none.glb --out a.ply", "--out: a.ply: unknown kind of file to write: use .npz"),
        ("from-gltf none.glb --out a.npz --driver d.bvh", "--driver: d.bvh: unknown kind of file to write: use .npz"),
        (WALK + "--out w.bvh", "--out: w.bvh: unknown kind of file to write: use .npz"),
        (WALK.replace("--flat ", "") + "--out w.npz", "walk needs --navmesh or --flat"),
        (STRIP + "--out s.jpg", "--out: s.jpg: unknown kind of file to write: use .png"),
        (STRIP + "--out s.png --begin 2 --end 1", "--begin"),
    ],
}
BOXES = [("5 0 0 1 1 1", "--crop: X0 5 must be below X1 1"), ("0 2 0 1 2 1", "--crop: Y0 2 must be below Y1 2"),
         ("0 0 nan 1 1 1", "--crop: nan: must be finite")]
CROPPED = {"gsnav-render": "none.ply --out o", "gsnav-convert": "none.ply out.ply", "gsnav-navmesh": "none.ply",
           "gsnav-eval": "none.ply", "gsnav-viewer": "none.ply", "nav_loop": "none.ply"}
# Programs that draw on the processor.
DRAWS = {**CROPPED, "gsnav-report": "none.ply --out o", "gsnav-replay": "--out none",
         "gsnav-avatar": STRIP + "--out s.png"}
# Values that an option with a number refuses, by the type in --help.
WRONG_NUMBERS = {"FLOAT": ["nan", "1e400", "", "0x10"], "UINT": ["9" * 30, "", " -1", "0x10"],
                 "INT": ["9" * 30, "", " -1", "0x10"]}
COMMANDS = {"gsnav-scene": ["flat", "rooms", "default", "humanoid"],
            "gsnav-avatar": ["from-gltf", "walk", "strip"]}
# Program: arguments, and the folders that stand where it writes files.
FOLDERS = {
    "gsnav-render": [("none.ply --out o", "o/0003.rgb.png"), ("none.ply --out o --npy", "o/0000.depth.npy")],
    "gsnav-convert": [("none.ply out.ply", "out.ply")],
    "gsnav-scene": [("flat --out a.ply", "a.ply"), ("flat --out a.ply --mesh a.obj", "a.obj")],
    "gsnav-navmesh": [("none.ply --png a.png", "a.png")],
    "gsnav-eval": [("none.ply --out o", "o/metrics.json"), ("none.ply --out o", "o/episodes/7_map.png")],
    "gsnav-report": [("none.ply --out o", "o/report.html"), ("none.ply --out o", "o/report.csv")],
    "gsnav-avatar": [("from-gltf none.glb --out a.npz", "a.npz"), (STRIP + "--out s.png", "s.png")],
    "nav_loop": [("none.ply --out o", "o/strip.png"), ("none.ply --out o", "o/frames/ep000_step0010_rgb.png")],
}


def options_with_numbers(program, command):
    """Name, type and number of values of each option of a program, or of one of its commands, with numbers."""
    text = subprocess.run([program, *command, "--help"], capture_output=True, text=True, timeout=60, check=True).stdout
    found = re.findall(r"^ +(?:-\w,)?(--[\w-]+) (FLOAT|UINT|INT)\b(?:.*? x (\d))?", text, re.M)
    return [(option, kind, int(count or 1)) for option, kind, count in found]


def main():
    folder, programs = sys.argv[1], [os.path.abspath(program) for program in sys.argv[2:]]
    wrong, asked = [], 0

    def check(program, arguments, status, said, environment=None):
        nonlocal asked
        asked += 1
        words = arguments.split() if isinstance(arguments, str) else arguments
        ran = subprocess.run([program, *words], cwd=folder, stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True, timeout=60, check=False, env=environment)
        if ran.returncode != status or said not in ran.stdout or "no such file" in ran.stdout:
            wrong.append(f"{program} {arguments}: status {ran.returncode} (want {status} and {said!r}): {ran.stdout}")

    for program in programs:
        name = os.path.basename(program)
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(folder)
        for arguments, said in USAGE.get(name, []):
            check(program, arguments, 2, said)
        for box, said in BOXES:
            if name in CROPPED:
                check(program, f"{CROPPED[name]} --crop {box}", 2, said)
        for command in [c.split() for c in COMMANDS.get(name, [""])]:
            for option, kind, count in options_with_numbers(program, command):
                for value in WRONG_NUMBERS[kind]:
                    check(program, [*command, option, *[value] * count], 2, f"{option}: ")
            for words in (["--help"], ["--version"]):
                check(program, [*command, *words], 0, "", {**os.environ, "GSNAV_ISA": "sse9"})
        if name in DRAWS:
            check(program, DRAWS[name], 2, "GSNAV_ISA=sse9: must be", {**os.environ, "GSNAV_ISA": "sse9"})
        if os.listdir(folder):
            wrong.append(f"{program}: left {os.listdir(folder)} after wrong command lines")
        for arguments, made in FOLDERS.get(name, []):
            shutil.rmtree(folder)
            os.makedirs(os.path.join(folder, made))
            check(program, arguments, 1, f"{os.path.basename(made)}: cannot be written: it is a folder")
    shutil.rmtree(folder, ignore_errors=True)
    print("\n".join(wrong) or f"{len(programs)} programs answer {asked} wrong command lines")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
