#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens a capture of 170 x 230 m in each program, by the same options.

usage: open_large.py FOLDER PROGRAM...
"""
import array
import math
import pathlib
import subprocess
import sys
import time

WIDE, DEEP, STEP = 170.0, 230.0, 0.5  # metres; Y is up
FIELDS = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
          "rot_2", "rot_3"]
# What the programs do with the scene, in the least time.
TASKS = {"gsnav-render": ["--orbit", "1", "--width", "64", "--height", "64", "--out", "views"],
         "gsnav-convert": ["out.spz", "--views", "0"],
         "gsnav-navmesh": ["--out", "out.navmesh"],
         "gsnav-eval": ["--episodes", "1", "--max-steps", "3", "--width", "32", "--height", "32", "--out", "eval"],
         "nav_loop": ["--episodes", "1", "--max-steps", "3", "--width", "32", "--height", "32", "--out", "loop"],
         "gsnav-viewer": ["--port", "0"],
         "gsnav-report": ["--quick", "--sizes", "32x32", "--views", "1", "--runs", "1", "--no-html", "--out", "report"]}


def save_ground(path):
    """Gently sloping ground with a house in the middle, whose roof is flat."""
    rows = array.array("f")
    flat, wide = math.log(0.03), math.log(0.5 * STEP)
    for i in range(int(WIDE / STEP)):
        for k in range(int(DEEP / STEP)):
            x, z = (i + 0.5) * STEP - WIDE / 2, (k + 0.5) * STEP - DEEP / 2
            y = 4.0 if abs(x) < 6 and abs(z) < 8 else 0.01 * x
            rows.extend((x, y, z, 0.3, 0.5, 0.1, 5, wide, flat, wide, 1, 0, 0, 0))
    if sys.byteorder != "little":
        rows.byteswap()
    head = "".join(f"property float {f}\n" for f in FIELDS)
    with open(path, "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows) // len(FIELDS)}\n{head}"
                   "end_header\n".encode())
        rows.tofile(file)


def opens(program, folder):
    """Why the program does not open the scene, or None."""
    name = pathlib.Path(program).name
    common = ["--scene", "ground.ply", "--up", "y"]
    if name not in ("gsnav-convert", "gsnav-render", "gsnav-report"):  # These build no NavMesh.
        common += ["--cell-size", "0.5"]
    if name in ("gsnav-eval", "nav_loop", "gsnav-viewer"):
        common += ["--avatars", "2"]
    command = [program, *common, *TASKS[name]]
    if name != "gsnav-viewer":
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        return None if run.returncode == 0 else f"{run.returncode}: {run.stderr.strip()[-300:]}"
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as viewer:
        said = ""
        for line in viewer.stdout:  # until it serves the page, or ends
            said += line
            if "http://" in line:
                viewer.terminate()
                return None
        return f"it ended: {said.strip()[-300:]}"


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    save_ground(folder / "ground.ply")
    wrong = []
    # gsnav-replay opens the scene of an evaluation.
    for program in [p for p in sys.argv[2:] if pathlib.Path(p).name != "gsnav-replay"]:
        begin = time.monotonic()
        why = opens(program, folder)
        print(f"{pathlib.Path(program).name}: {why or 'opens it'}, {time.monotonic() - begin:.1f} s", flush=True)
        wrong += [program] if why else []
    sys.exit(1 if wrong or len(sys.argv) < 3 else 0)


if __name__ == "__main__":
    main()
