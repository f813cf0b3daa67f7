#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Shows that the tests would notice: puts naive formulas back, one at a time, and runs what must fail.

    tools/planted_regressions.py [--list | --check] [--only NAME ...] [--scratch DIR] [--cxx COMPILER] [--jobs N]

The tree is copied; the original is never touched. A plant needs one translation unit of tests, header-only
with OpenMP, the sources of what that includes of tests/, and of the libraries at most the few files that it
names, so nothing is built before. First every
test case named must pass as the source is; then each plant's must fail. Exit status: 0 all caught, 1 one
missed, 2 nothing could be said (a text to replace is not there once, a plant does not compile, a case fails
unplanted). --check only looks whether each text to replace is there once: a second, and a test of every build.
"""
import argparse
import concurrent.futures
import importlib
import os
import pathlib
import pkgutil
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import planted  # noqa: E402

FLAGS = ["-std=c++20", "-O1", "-ffp-contract=off", "-fopenmp", "-w", "-Iinclude", "-Ibackends/serial",
         "-Ibackends/openmp", "-Itests", "-Isrc/io", '-DGSNAV_DATA_DIR="/nonexistent"']
FOLDERS = ("include", "backends", "src", "tests")
CASE_TIMEOUT_S = 600


def all_plants():
    plants = []
    for module in sorted(m.name for m in pkgutil.iter_modules(planted.__path__)):
        plants += importlib.import_module(f"planted.{module}").PLANTS
    names = [p.name for p in plants]
    assert len(names) == len(set(names)), "two plants of one name"
    return plants


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
    """What defines what the headers that a test includes declare: the sources of their names, in tests/ and avatar."""
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
            if header.is_relative_to(tree / "include/gsnav/avatar"):
                beside = tree / "src/avatar" / beside.name
            elif not any(header.is_relative_to(tree / d) for d in ("tests", "src/avatar")):
                continue
            if beside.is_file() and beside.name != "compiled_frames.cpp":
                queue.append(beside)
                found.append(str(beside.relative_to(tree)))
    return found


class Bench:
    """A copy of the tree that compiles and runs tests."""

    def __init__(self, scratch, cxx):
        self.cxx, self.tree = cxx, scratch / "tree"
        if self.tree.exists():
            shutil.rmtree(self.tree)
        copy_tree(self.tree)
        # A test is linked with nothing here: it has to instantiate what the suites have compiled once.
        for header in (self.tree / "tests").rglob("*.hpp"):
            header.write_text(re.sub(r"extern template [^;]*;", "", header.read_text()))
        self.main = scratch / "main.o"
        self.run([cxx, *FLAGS, "-c", "tests/support/main.cpp", "-o", str(self.main)], check=True)

    def run(self, command, cwd=None, **kwargs):
        return subprocess.run(command, cwd=cwd or self.tree, text=True, capture_output=True, **kwargs)

    def build(self, plant, binary, tree=None):
        """Its test, planted or not. Returns what the compiler said, or nothing."""
        sources = [plant.source, *sources_beside(self.tree, plant.source), *plant.more]
        done = self.run([self.cxx, *FLAGS, *sources, str(self.main), "-o", str(binary)], cwd=tree)
        return "" if done.returncode == 0 else done.stderr.strip() or "the compiler failed"

    def fails(self, binary, case):
        """How a test case ended, or nothing where it passed."""
        try:
            done = self.run([str(binary), f"-tc={case}"], timeout=CASE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return "timeout"
        if "test cases: 0 |" in " ".join(done.stdout.split()):
            return "no such case"
        if done.returncode == 0:
            return ""
        return "failed" if done.returncode == 1 else f"ended by {done.returncode}"


def misplaced(tree, plant):
    """A text of the plant that is not there once, or nothing."""
    for e in plant.edits:
        found = (tree / e.file).read_text().count(e.old)
        if found != 1:
            return f"{e.file} holds {found} times: {e.old.strip().splitlines()[0]}"
    return ""


def apply(tree, plant):
    if wrong := misplaced(tree, plant):
        return wrong
    for e in plant.edits:
        path = tree / e.file
        path.write_text(path.read_text().replace(e.old, e.new))
    return ""


def check_plant(bench, plant, scratch):
    """Returns (verdict, remark)."""
    tree = scratch / plant.name
    shutil.copytree(bench.tree, tree)
    try:
        if wrong := apply(tree, plant):
            return "BROKEN", wrong
        binary = scratch / f"{plant.name}.bin"
        if said := bench.build(plant, binary, tree):
            return "BROKEN", "does not compile: " + next((l for l in said.splitlines() if "error" in l), said)
        missed = [c for c in plant.cases if not bench.fails(binary, c)]
        binary.unlink()
        return ("MISSED", ", ".join(missed)) if missed else ("caught", ", ".join(plant.cases))
    finally:
        shutil.rmtree(tree)


def check_unplanted(bench, plants, scratch, pool):
    """Every case that a plant must fail passes as it is. Returns what does not."""
    def check(some):
        source = some[0].source
        binary = scratch / (source.replace("/", "_") + ".bin")
        if said := bench.build(some[0], binary):
            return [f"{source} does not compile: {said.splitlines()[0]}"]
        cases = sorted({c for p in some for c in p.cases})
        return [f"{source}: {c}: {how} without a plant" for c in cases if (how := bench.fails(binary, c))]

    by_source = {}
    for p in plants:
        by_source.setdefault(p.source, []).append(p)
        assert p.more == by_source[p.source][0].more, f"{p.source} is compiled in two ways"
    return sum(pool.map(check, by_source.values()), [])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--scratch", type=pathlib.Path)
    parser.add_argument("--cxx", default=os.environ.get("CXX", "c++"))
    parser.add_argument("--jobs", type=int, default=1)
    args = parser.parse_args()
    plants = [p for p in all_plants() if not args.only or p.name in args.only]
    if args.list:
        for p in plants:
            print(f"{p.name:32} {p.source}: {', '.join(p.cases)}")
        return 0
    if args.check:
        wrong = [f"{p.name}: {w}" for p in plants if (w := misplaced(ROOT, p))]
        print("\n".join(wrong) or f"{len(plants)} plants have their place")
        return 2 if wrong else 0
    if not plants:
        parser.error("no plant of that name")
    verdicts = []
    with tempfile.TemporaryDirectory(dir=args.scratch) as folder, \
            concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        scratch = pathlib.Path(folder)
        bench = Bench(scratch, args.cxx)
        if wrong := check_unplanted(bench, plants, scratch, pool):
            print("\n".join(wrong))
            return 2
        print(f"{len({(p.source, c) for p in plants for c in p.cases})} test cases pass unplanted", flush=True)
        found = pool.map(lambda p: check_plant(bench, p, scratch), plants)
        for p, (verdict, remark) in zip(plants, found):
            verdicts.append(verdict)
            print(f"{p.name:32} {verdict:7} {remark}", flush=True)
    print(f"{verdicts.count('caught')} of {len(plants)} caught")
    return 2 if "BROKEN" in verdicts else 1 if "MISSED" in verdicts else 0


if __name__ == "__main__":
    sys.exit(main())
