#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutation tests: seeds one fault at a time into a copy of the sources and runs the test cases that must fail.

    tests/mutation/mutate.py [--list | --check] [--only NAME ...] [--scratch DIR] [--cxx COMPILER] [--jobs N]

A fault names a function, the tokens to replace in it, and test cases. Each needs one translation unit of tests,
header-only with OpenMP, the sources of what that includes of tests/, and at most the few library files that it names,
so nothing is built before. A .cu needs the emulated CUDA runtime, and a fault that `cuda` must notice all of that
backend. First every named case must pass on the sources as they are; then the cases of each fault must fail, on each
backend by itself where the fault names backends. Exit status: 0 all faults are caught, 1 one is missed, 2 no verdict
(the tokens do not stand in the function exactly once, a fault does not compile, a case fails without a fault).
--check only looks whether each fault has its place and its cases, and whether headers of tests declare nothing that
another file instantiates: a second, and a test of every build. With `--cxx "ccache c++"`, what a fault does not change
is compiled once.
"""
import argparse
import concurrent.futures
import fnmatch
import importlib
import os
import pathlib
import pkgutil
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE))
import faults as fault_lists  # noqa: E402
from sources import Sources  # noqa: E402

FLAGS = ["-std=c++20", "-O1", "-ffp-contract=off", "-fopenmp", "-DGSNAV_OPENMP_HEADER_ONLY", "-w", "-Iinclude",
         "-Ibackends/serial", "-Ibackends/openmp", "-Itests", "-Isrc/io", '-DGSNAV_DATA_DIR="/nonexistent"']
FOLDERS = ("include", "backends", "src", "tests")
EMULATED = "backends/cuda/emulated"
REWRITTEN = "rewritten"  # device code as C++, in each tree
CASE_TIMEOUT_S = 600
NOBODY = "no backend"  # value of GSNAV_CASES_ON with which no renderer runs


def all_faults():
    faults = []
    for module in sorted(m.name for m in pkgutil.iter_modules(fault_lists.__path__)):
        faults += importlib.import_module(f"faults.{module}").FAULTS
    names = [f.name for f in faults]
    assert len(names) == len(set(names)), "two faults of one name"
    return faults


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


def left_declarations():
    """Headers of tests in which without_declarations() leaves a declaration."""
    return [f"{f.relative_to(ROOT)}: declares templates that are instantiated elsewhere, in a form that is not known"
            for f in sorted((ROOT / "tests").rglob("*.hpp"))
            if re.search(r"\bextern\b(?! \"C\")", without_declarations(f.read_text()))]


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

    def build(self, fault, binary, tree=None):
        """Its test, with the fault or without. Returns what the compiler said, or nothing."""
        tree = tree or self.tree
        sources, flags = [fault.source, *sources_beside(self.tree, fault.source), *fault.more], FLAGS
        if fault.on_device:
            sources = [*self.device_code_as_cpp(tree, fault), *sources[1:]]
            sources += [str(f.relative_to(tree)) for f in sorted((tree / EMULATED).glob("*.cpp"))]
            flags = [*FLAGS, f"-I{REWRITTEN}", f"-I{EMULATED}", f"-I{EMULATED}/include", "-Ibackends/cuda",
                     "-DGSNAV_HAS_CUDA"]
        # One by one and by relative paths: a compiler cache has what a fault does not change.
        objects = [f"{binary}.{i}.o" for i in range(len(sources))]
        compiled = [[*self.cxx, *flags, "-c", source, "-o", o] for source, o in zip(sources, objects)]
        for command in [*compiled, [*self.cxx, "-fopenmp", *objects, str(self.main), "-o", str(binary)]]:
            done = self.run(command, cwd=tree)
            if done.returncode != 0:
                return done.stderr.strip() or "the compiler failed"
        for o in objects:
            pathlib.Path(o).unlink()
        return ""

    def device_code_as_cpp(self, tree, fault):
        """Rewrites all device headers, and a test of device code or all sources of the backend. Returns what to
        compile in place of the test, as paths in the tree."""
        folder, to = tree / "backends/cuda", pathlib.Path(REWRITTEN)
        files = {f"backends/cuda/{f.relative_to(folder)}": to / f.relative_to(folder)
                 for f in folder.rglob("*.cuh") if "emulated" not in f.parts}
        if fault.source.endswith(".cu"):
            compiled = {fault.source: to / pathlib.Path(fault.source).with_suffix(".cpp").name}
        else:  # gl_image.cu needs OpenGL
            compiled = {f"backends/cuda/src/{f.name}": to / "src" / f.with_suffix(".cpp").name
                        for f in (folder / "src").glob("*.cu") if f.name != "gl_image.cu"}
        for source, target in {**files, **compiled}.items():
            (tree / target).parent.mkdir(parents=True, exist_ok=True)
            self.run([sys.executable, f"{EMULATED}/rewrite.py", source, str(target)], cwd=tree, check=True)
        tests = [] if fault.source in compiled else [fault.source]
        return tests + [str(f) for f in compiled.values()]

    def fails(self, binary, case, backend=None):
        """How a test case ended, on one backend or all, or nothing where it passed."""
        env = os.environ | ({"GSNAV_CASES_ON": backend} if backend else {})
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


def place_of(sources, edit):
    """(file, begin, end) of the tokens to replace, or why there is no such place."""
    found = sources.find(edit.function, edit.old)
    if len(found) == 1:
        return found[0], ""
    return None, f"{edit.function} holds {len(found)} times: {edit.old.strip().splitlines()[0]}"


def misplaced(sources, fault):
    """Why an edit of the fault has no place, or nothing."""
    return next((why for e in fault.edits if (why := place_of(sources, e)[1])), "")


def absent_cases(fault):
    """The cases of a fault that its test does not have."""
    string = r'"((?:[^"\\]|\\.)*)"'
    written = re.findall(rf"\bTEST_CASE\(\s*((?:{string}\s*)+)\)", (ROOT / fault.source).read_text())
    names = ["".join(re.findall(string, parts)) for parts, _ in written]
    return [f"{fault.name}: {fault.source} has no case {c}" for c in fault.cases if not fnmatch.filter(names, c)]


def apply(tree, fault):
    for e in fault.edits:
        place, why = place_of(Sources(tree), e)
        if why:
            return why
        file, begin, end = place
        text = file.read_text()
        file.write_text(text[:begin] + e.new.strip() + text[end:])
    return ""


def check_fault(bench, fault, scratch):
    """Returns (verdict, remark)."""
    tree = scratch / fault.name
    shutil.copytree(bench.tree, tree)
    try:
        if wrong := apply(tree, fault):
            return "BROKEN", wrong
        binary = scratch / f"{fault.name}.bin"
        if said := bench.build(fault, binary, tree):
            return "BROKEN", "does not compile: " + next((l for l in said.splitlines() if "error" in l), said)
        runs = [(c, b) for c in fault.cases for b in (fault.on or [None])]
        missed = [f"{c} on {b}" if b else c for c, b in runs if not bench.fails(binary, c, b)]
        missed += [f"{c} without any backend: it does not show who noticed" for c in fault.cases
                   if fault.on and bench.fails(binary, c, NOBODY)]
        binary.unlink()
        if missed:
            return "MISSED", ", ".join(missed)
        return "caught", ", ".join(fault.cases) + (f" on each of {', '.join(fault.on)}" if fault.on else "")
    finally:
        shutil.rmtree(tree)


def check_unchanged(bench, faults, scratch, pool):
    """Every case that a fault must fail passes on the unchanged sources. Returns what does not."""
    def check(some):
        source = some[0].source
        binary = scratch / (source.replace("/", "_") + (".device" if some[0].on_device else "") + ".bin")
        if said := bench.build(some[0], binary):
            return [f"{source} does not compile: {said.splitlines()[0]}"]
        runs = sorted({(c, b) for p in some for c in p.cases for b in ("", *p.on)})
        return [f"{source}: {c}: {how} without a fault" for c, b in runs if (how := bench.fails(binary, c, b))]

    by_source = {}
    for p in faults:
        same = by_source.setdefault((p.source, p.on_device), [])
        same.append(p)
        assert p.more == same[0].more, f"{p.source} is compiled in two ways"
    return sum(pool.map(check, by_source.values()), [])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--scratch", type=pathlib.Path, help="folder for copies of the sources; made if absent")
    parser.add_argument("--cxx", default=os.environ.get("CXX", "c++"))
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    faults = [p for p in all_faults() if not args.only or p.name in args.only]
    if args.list:
        for p in faults:
            print(f"{p.name:32} {p.source}: {', '.join(p.cases)}")
        return 0
    if args.check:
        sources = Sources(ROOT)
        wrong = [f"{f.name}: {w}" for f in faults if (w := misplaced(sources, f))] + left_declarations()
        wrong += sum(map(absent_cases, faults), [])
        print("\n".join(wrong) or f"{len(faults)} faults have their place")
        return 2 if wrong else 0
    if not faults:
        parser.error("no fault of that name")
    if args.scratch is not None:
        args.scratch.mkdir(parents=True, exist_ok=True)
    verdicts = []
    with tempfile.TemporaryDirectory(dir=args.scratch) as folder, \
            concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        scratch = pathlib.Path(folder)
        bench = Bench(scratch, args.cxx)
        if wrong := check_unchanged(bench, faults, scratch, pool):
            print("\n".join(wrong))
            return 2
        print(f"{len({(p.source, c) for p in faults for c in p.cases})} test cases pass without a fault", flush=True)
        found = pool.map(lambda p: check_fault(bench, p, scratch), faults)
        for p, (verdict, remark) in zip(faults, found):
            verdicts.append(verdict)
            print(f"{p.name:32} {verdict:7} {remark}", flush=True)
    print(f"{verdicts.count('caught')} of {len(faults)} caught")
    return 2 if "BROKEN" in verdicts else 1 if "MISSED" in verdicts else 0


if __name__ == "__main__":
    sys.exit(main())
