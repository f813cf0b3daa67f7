#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles every public header alone, twice included, with warnings as errors.

usage: check_headers.py COMPILER [--nvcc] [--system DIR]... [--have eigen|glm|dlpack]...

Headers are found when the check runs, so a new one is covered without a new configure. --system adds
a folder of third-party headers; an interop header is compiled where --have names its library.
"""
import argparse
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
BACKENDS = [ROOT / "backends" / name for name in ("serial", "openmp", "cuda")]
NEEDS = {"gsnav/interop/eigen.hpp": "eigen", "gsnav/interop/glm.hpp": "glm",
         "gsnav/interop/dlpack.hpp": "dlpack"}
DEVICE_LAYERS = ("math", "core", "kernels", "ops")
HOST_ONLY = ("gsnav/math/pack", "gsnav/kernels/lanes/")  # lanes are host vectors
WARNINGS = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow"]


def layer(header):
    parts = header.split("/")
    return parts[1] if len(parts) > 2 else ""


def headers(args):
    found = []
    for folder in [ROOT / "include", *BACKENDS]:
        found += [h.relative_to(folder).as_posix() for h in sorted((folder / "gsnav").rglob("*.hpp"))]
    found = [h for h in found if NEEDS.get(h, "") in ["", *args.have]]
    if args.nvcc:
        found = [h for h in found if layer(h) in DEVICE_LAYERS and not h.startswith(HOST_ONLY)]
    return found


def compile_alone(header, args, scratch):
    """The compiler's output, empty where it accepts the header."""
    include = [f"-I{d}" for d in [ROOT / "include", *BACKENDS]]
    if header in NEEDS:
        include += [f"-isystem{d}" for d in args.system]
    name = header.replace("/", "_")
    source = scratch / (name + (".cu" if args.nvcc else ".cpp"))
    source.write_text(f'#include "{header}"\n#include "{header}"\n', encoding="utf-8")
    if args.nvcc:
        # 2810: nvcc takes the assignment of a nodiscard class for a value dropped; g++ and clang know.
        command = [args.compiler, "-std=c++20", "-Werror", "all-warnings", "-diag-suppress", "2810",
                   "-Xcompiler", "-Wall,-Wextra", *include, "-c", str(source), "-o", str(scratch / (name + ".o"))]
    else:
        command = [args.compiler, "-std=c++20", "-fsyntax-only", "-Werror", *WARNINGS, *include]
        if layer(header) in DEVICE_LAYERS:
            command += ["-fno-exceptions", "-fno-rtti"]
        command.append(str(source))
    run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if run.returncode == 0 and not run.stdout.strip():
        return ""
    return f"{' '.join(command)}\n{run.stdout}(exit status {run.returncode})"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("compiler")
    parser.add_argument("--nvcc", action="store_true")
    parser.add_argument("--system", action="append", default=[])
    parser.add_argument("--have", action="append", default=[])
    args = parser.parse_args()
    checked = headers(args)
    with tempfile.TemporaryDirectory() as scratch, \
            concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        outputs = pool.map(lambda h: compile_alone(h, args, pathlib.Path(scratch)), checked)
        wrong = [f"--- {h}\n{text}" for h, text in zip(checked, outputs) if text]
    print("\n".join(wrong))
    print(f"{args.compiler}: {len(checked) - len(wrong)} of {len(checked)} headers compile alone")
    sys.exit(1 if wrong or not checked else 0)


if __name__ == "__main__":
    main()
