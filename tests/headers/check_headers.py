#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles every public header, alone and twice included, with warnings as errors.

usage: check_headers.py COMPILER [--nvcc] [--together] [--system DIR]... [--have eigen|glm|dlpack]...

Headers are found when the check runs, so a new one is covered without a new configure. --system adds
a folder of third-party headers; an interop header is compiled where --have names its library.

Where each header of a list includes the one before it, the list is compiled as one file, innermost
first. A header then follows only what it includes itself, so the result is the same as alone. With
--together, all headers with the same options are compiled as one file. That shows this compiler's
warnings, but not whether each header includes what it uses: check that with another compiler. Where a
file of several headers fails, each of them is compiled alone.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[2]
BACKENDS = sorted(p.parent for p in (ROOT / "backends").glob("*/gsnav"))
NEEDS = {"gsnav/interop/eigen.hpp": "eigen", "gsnav/interop/glm.hpp": "glm",
         "gsnav/interop/dlpack.hpp": "dlpack"}
DEVICE_LAYERS = ("math", "core", "image", "frame", "skin", "sweep", "mesh", "lanes", "render")
HOST_ONLY = ("gsnav/detail/math/pack", "gsnav/detail/lanes/")  # lanes are host vectors
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow"]
DEFINES = ["-DGSNAV_OPENMP_HEADER_ONLY"]


def layer(header):
    parts = header.replace("gsnav/detail/", "gsnav/").split("/")
    return parts[1] if len(parts) > 2 else ""


def headers(args):
    found = []
    for folder in [ROOT / "include", *BACKENDS]:
        found += [h.relative_to(folder).as_posix() for h in sorted((folder / "gsnav").rglob("*.hpp"))]
    found = [h for h in found if NEEDS.get(h, "") in ["", *args.have]]
    if args.nvcc:
        found = [h for h in found if layer(h) in DEVICE_LAYERS and not h.startswith(HOST_ONLY)]
    return found


def strict(header):
    return layer(header) in DEVICE_LAYERS


def options(header):
    return strict(header), header in NEEDS


def chains(checked):
    """The fewest lists of headers with the same options, each header including the one before it."""
    texts = {}
    for folder in [ROOT / "include", *BACKENDS]:
        for h in checked:
            if (folder / h).is_file():
                texts[h] = (folder / h).read_text(encoding="utf-8")
    inner = {}  # all that a header includes

    def visit(h):
        if h not in inner:
            inner[h] = set()
            for other in re.findall(r'#include [<"]([^">]+)[">]', texts[h]):
                if other in texts:
                    visit(other)
                    inner[h] |= {other} | inner[other]
    for h in checked:
        visit(h)
    before = {}  # of a header, the one before it in its list

    def place(h, tried):
        for outer in checked:
            if h in inner[outer] and outer not in tried and options(outer) == options(h):
                tried.add(outer)
                if outer not in before or place(before[outer], tried):
                    before[outer] = h
                    return True
        return False
    for h in checked:
        place(h, set())
    found = []
    for h in set(checked) - set(before.values()):
        chain = [h]
        while chain[0] in before:
            chain.insert(0, before[chain[0]])
        found.append(chain)
    return sorted(found, key=len, reverse=True)


def compile_headers(checked, args, scratch):
    """The compiler's output, empty where it accepts the headers in one file; all need the options of the first."""
    include = [f"-I{d}" for d in [ROOT / "include", *BACKENDS]]
    if any(h in NEEDS for h in checked):
        include += [f"-isystem{d}" for d in args.system]
    name = str(len(checked)) + "_" + checked[0].replace("/", "_")
    source = scratch / (name + (".cu" if args.nvcc else ".cpp"))
    source.write_text("".join(f'#include "{h}"\n' for h in checked) * 2, encoding="utf-8")
    if args.nvcc:
        # 2810: nvcc takes the assignment of a nodiscard class for a value dropped; g++ and clang know.
        command = [args.compiler, "-std=c++20", "-Werror", "all-warnings", "-diag-suppress", "2810",
                   "-Xcompiler", "-Wall,-Wextra", *include, "-c", str(source), "-o", str(scratch / (name + ".o"))]
    else:
        command = [args.compiler, "-std=c++20", "-fsyntax-only", "-Werror", *WARNINGS, *DEFINES, *include]
        if strict(checked[0]):
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
    parser.add_argument("--together", action="store_true")
    parser.add_argument("--system", action="append", default=[])
    parser.add_argument("--have", action="append", default=[])
    args = parser.parse_args()
    checked = headers(args)
    groups = chains(checked)
    if args.together:
        groups = [[h for h in checked if strict(h)], [h for h in checked if not strict(h)]]
    with tempfile.TemporaryDirectory() as scratch, \
            concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        def outputs(parts):
            return list(pool.map(lambda part: compile_headers(part, args, pathlib.Path(scratch)), parts))
        groups = [g for g in groups if g]
        wrong = [(g, text) for g, text in zip(groups, outputs(groups)) if text]
        if wrong:
            alone = [[h] for g, _ in wrong for h in g]
            each = [(g, text) for g, text in zip(alone, outputs(alone)) if text]
            wrong = each or wrong  # of headers that are accepted alone, not beside each other
    print("\n".join(f"--- {' '.join(g)}\n{text}" for g, text in wrong))
    refused = sum(len(g) for g, _ in wrong)
    print(f"{args.compiler}: {len(checked) - refused} of {len(checked)} headers compile "
          f"{'together' if args.together else 'alone'}, in {len(groups)} files")
    sys.exit(1 if wrong or not checked else 0)


if __name__ == "__main__":
    main()
