# SPDX-License-Identifier: Apache-2.0
"""A copy of the sources that compiles and runs tests, and the verdict on a fault that such a test holds."""
from __future__ import annotations

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

from switches import VARIABLE

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FLAGS = ["-std=c++20", "-O1", "-ffp-contract=off", "-fopenmp", "-DGSNAV_OPENMP_HEADER_ONLY", "-w", "-Iinclude",
         "-Ibackends/serial", "-Ibackends/openmp", "-Itests", "-Isrc/io", '-DGSNAV_DATA_DIR="/nonexistent"']
DEVICE_FLAGS = [*FLAGS, "-Irewritten", "-Ibackends/cuda/emulated", "-Ibackends/cuda/emulated/include",
                "-Ibackends/cuda", "-DGSNAV_HAS_CUDA"]
FOLDERS = ("include", "backends", "src", "tests")
EMULATED = "backends/cuda/emulated"
REWRITTEN = "rewritten"  # device code as C++, in each tree
CASE_TIMEOUT_S = 600
NOBODY = "no backend"  # value of GSNAV_CASES_ON with which no renderer runs


def copy_tree(to):
    """What git would commit, and what is new beside it; without git the folders that tests need."""
    try:
        listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z", *FOLDERS], cwd=ROOT,
                                capture_output=True, check=True).stdout
        files = [f for f in listed.decode().split("\0") if f and (ROOT / f).is_file()]
    except (OSError, subprocess.CalledProcessError):
        files = [str(f.relative_to(ROOT)) for d in FOLDERS for f in (ROOT / d).rglob("*") if f.is_file()]
    for f in files:
        target = to / f
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / f, target)


def sources_beside(tree, source):
    """What defines what the headers that a test includes declare: the sources of their names, in tests/ and in the
    components that need no library."""
    components = ("avatar", "rigging", "demo")
    seen, found, queue = set(), [], [tree / source]
    while queue:
        file = queue.pop()
        for name in re.findall(r'^#include "([^"]+)"', file.read_text(), re.MULTILINE):
            places = (file.parent / name, tree / "tests" / name, tree / "include" / name)
            header = next((pathlib.Path(os.path.normpath(h)) for h in places if h.is_file()), None)
            if header is None or header in seen:
                continue
            seen.add(header)
            queue.append(header)
            beside = header.with_suffix(".cpp")
            if header.parent.name in components and header.is_relative_to(tree / "include"):
                beside = tree / "src" / header.parent.name / beside.name
            elif not any(header.is_relative_to(tree / d) for d in ("tests", *(f"src/{c}" for c in components))):
                continue
            if beside.is_file() and beside.name != "compiled_frames.cpp":
                queue.append(beside)
                found.append(str(beside.relative_to(tree)))
    return found


def without_declarations(text):
    """A header of tests without its declarations of templates that are instantiated elsewhere."""
    return re.sub(r"(extern template |\b[A-Z_]+\(extern\b)[^;]*;", "", text)


class Bench:
    """A copy of the tree that compiles and runs tests."""

    def __init__(self, scratch, cxx):
        self.cxx, self.tree = shlex.split(cxx), scratch / "tree"
        if self.tree.exists():
            shutil.rmtree(self.tree)
        copy_tree(self.tree)
        # A test is linked with nothing here: it has to instantiate what the suites have compiled once.
        for header in (self.tree / "tests").rglob("*.hpp"):
            header.write_text(without_declarations(header.read_text()))
        self.main = scratch / "main.o"
        self.run([*self.cxx, *FLAGS, "-c", "tests/support/main.cpp", "-o", str(self.main)], check=True)

    def run(self, command, cwd=None, **kwargs):
        return subprocess.run(command, cwd=cwd or self.tree, text=True, capture_output=True, **kwargs)

    def parts(self, fault):
        """What its test is compiled of: sources, flags, and the device code to rewrite as C++ before, {from: to}."""
        sources, flags, device_code = [fault.source, *sources_beside(self.tree, fault.source), *fault.more], FLAGS, {}
        if fault.on_device:
            headers, compiled = self.device_code(fault)
            tests = [] if fault.source in compiled else [fault.source]
            sources = [*tests, *compiled.values(), *sources[1:],
                       *(str(f.relative_to(self.tree)) for f in sorted((self.tree / EMULATED).glob("*.cpp")))]
            flags, device_code = DEVICE_FLAGS, headers | compiled
        return sources, flags, device_code

    def device_code(self, fault):
        """All device headers, and a test of device code or all sources of the backend: {path: path as C++} of each."""
        folder, to = self.tree / "backends/cuda", pathlib.Path(REWRITTEN)
        headers = {f"backends/cuda/{f.relative_to(folder)}": str(to / f.relative_to(folder))
                   for f in folder.rglob("*.cuh") if "emulated" not in f.parts}
        if fault.source.endswith(".cu"):
            return headers, {fault.source: str(to / pathlib.Path(fault.source).with_suffix(".cpp").name)}
        return headers, {f"backends/cuda/src/{f.name}": str(to / "src" / f.with_suffix(".cpp").name)
                         for f in (folder / "src").glob("*.cu") if f.name != "gl_image.cu"}  # that needs OpenGL

    def rewrite(self, tree, device_code):
        for source, target in device_code.items():
            (tree / target).parent.mkdir(parents=True, exist_ok=True)
            self.run([sys.executable, f"{EMULATED}/rewrite.py", source, target], cwd=tree, check=True)

    def compile(self, tree, source, flags, to):
        """Returns what the compiler said, or nothing."""
        # By a relative path: a compiler cache has what a fault does not change.
        done = self.run([*self.cxx, *flags, "-c", source, "-o", str(to)], cwd=tree)
        return "" if done.returncode == 0 else done.stderr.strip() or "the compiler failed"

    def link(self, objects, binary):
        done = self.run([*self.cxx, "-fopenmp", *map(str, objects), str(self.main), "-o", str(binary)])
        return "" if done.returncode == 0 else done.stderr.strip() or "the linker failed"

    def build(self, fault, binary, tree=None):
        """Its test, with the fault or without. Returns what the compiler said, or nothing."""
        tree = tree or self.tree
        sources, flags, device_code = self.parts(fault)
        self.rewrite(tree, device_code)
        objects = [f"{binary}.{i}.o" for i in range(len(sources))]
        said = next((s for source, o in zip(sources, objects) if (s := self.compile(tree, source, flags, o))), "")
        said = said or self.link(objects, binary)
        for o in objects:
            pathlib.Path(o).unlink(missing_ok=True)
        return said

    def fails(self, binary, case, backend=None, number=0):
        """How a test case ended, on one backend or all, or nothing where it passed. A binary that holds many faults
        has that of the number, or none."""
        env = os.environ | ({"GSNAV_CASES_ON": backend} if backend else {}) | {VARIABLE: str(number)}
        try:
            name = case.replace(",", "?")  # doctest cuts the list of names at commas
            done = self.run([str(binary), f"-tc={name}"], timeout=CASE_TIMEOUT_S, env=env)
        except subprocess.TimeoutExpired:
            return "timeout"
        if "test cases: 0 |" in " ".join(done.stdout.split()):
            return "no such case"
        if done.returncode == 0:
            return ""
        return "failed" if done.returncode == 1 else f"ended by {done.returncode}"


def first_error(said):
    return next((line for line in said.splitlines() if "error" in line), said)


def judge(bench, fault, binary, number=0):
    """(verdict, remark) on a fault by its test, in which it stands alone or by its number."""
    runs = [(c, b) for c in fault.cases for b in (fault.on or [None])]
    missed = [f"{c} on {b}" if b else c for c, b in runs if not bench.fails(binary, c, b, number)]
    missed += [f"{c} without any backend: it does not show who noticed" for c in fault.cases
               if fault.on and bench.fails(binary, c, NOBODY, number)]
    if missed:
        return "MISSED", ", ".join(missed)
    return "caught", ", ".join(fault.cases) + (f" on each of {', '.join(fault.on)}" if fault.on else "")


def by_test(faults):
    """The faults of each test, one with device code and one without."""
    tests = {}
    for p in faults:
        same = tests.setdefault((p.source, p.on_device), [])
        same.append(p)
        assert p.more == same[0].more, f"{p.source} is compiled in two ways"
    return list(tests.values())


def binary_of(fault, scratch):
    return scratch / (fault.source.replace("/", "_") + (".device" if fault.on_device else "") + ".bin")


def fails_unchanged(bench, some, binary):
    """What does not pass of the cases that faults of one test must fail, without them."""
    runs = sorted({(c, b) for p in some for c in p.cases for b in ("", *p.on)})
    return [f"{some[0].source}: {c}: {how} without a fault" for c, b in runs if (how := bench.fails(binary, c, b))]
