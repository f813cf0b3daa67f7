#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Mutation tests: seeds one fault at a time into a copy of the sources and runs the test cases that must fail.

    tests/mutation/mutate.py [--list | --check | --together] [--only NAME ...] [--scratch DIR] [--cxx COMPILER]
                             [--jobs N]

A fault names a function, the tokens to replace in it, and test cases. Each needs one translation unit of tests,
header-only with OpenMP, the sources of what that includes of tests/, and at most the few library files that it names,
so nothing is built before. A .cu needs the emulated CUDA runtime, and a fault that `cuda` must notice all of that
backend. First every named case must pass on the sources as they are; then the cases of each fault must fail, on each
backend by itself where the fault names backends. Exit status: 0 all faults are caught, 1 one is missed, 2 no verdict
(the tokens do not stand in the function exactly once, a fault does not compile, a case fails without a fault).
--check only looks whether each fault has its place and its cases, and whether headers of tests declare nothing that
another file instantiates: a second, and a test of every build. With `--cxx "ccache c++"`, what a fault does not change
is compiled once. --together compiles all tests once, with all faults, and chooses a fault at run time
(tests/mutation/switches.py); faults that this cannot do or does not catch are then checked as without it.
"""
import argparse
import concurrent.futures
import fnmatch
import importlib
import os
import pathlib
import pkgutil
import re
import shutil
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import faults as fault_lists  # noqa: E402
from bench import (ROOT, Bench, binary_of, by_test, fails_unchanged, first_error, judge,  # noqa: E402
                   without_declarations)
from sources import Sources, place_of  # noqa: E402
from together import check_together  # noqa: E402


def all_faults():
    faults = []
    for module in sorted(m.name for m in pkgutil.iter_modules(fault_lists.__path__)):
        faults += importlib.import_module(f"faults.{module}").FAULTS
    names = [f.name for f in faults]
    assert len(names) == len(set(names)), "two faults of one name"
    return faults


def left_declarations():
    """Headers of tests in which without_declarations() leaves a declaration."""
    return [f"{f.relative_to(ROOT)}: declares templates that are instantiated elsewhere, in a form that is not known"
            for f in sorted((ROOT / "tests").rglob("*.hpp"))
            if re.search(r"\bextern\b(?! \"C\")", without_declarations(f.read_text()))]


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
            return "BROKEN", f"does not compile: {first_error(said)}"
        verdict = judge(bench, fault, binary)
        binary.unlink()
        return verdict
    finally:
        shutil.rmtree(tree)


def check_unchanged(bench, faults, scratch, pool):
    """Every case that a fault must fail passes on the unchanged sources. Returns what does not."""
    def check(some):
        binary = binary_of(some[0], scratch)
        if said := bench.build(some[0], binary):
            return [f"{some[0].source} does not compile: {said.splitlines()[0]}"]
        return fails_unchanged(bench, some, binary)

    return sum(pool.map(check, by_test(faults)), [])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--together", action="store_true", help="compile all faults once, and choose one at run time")
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

    def report(fault, verdict, remark):
        verdicts.append(verdict)
        print(f"{fault.name:32} {verdict:7} {remark}", flush=True)

    with tempfile.TemporaryDirectory(dir=args.scratch) as folder, \
            concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        scratch = pathlib.Path(folder)
        bench = Bench(scratch, args.cxx)
        apart = check_together(bench, faults, scratch, pool, report) if args.together else faults
        if wrong := check_unchanged(bench, apart, scratch, pool):
            print("\n".join(wrong))
            return 2
        if apart:
            cases = {(p.source, c) for p in apart for c in p.cases}
            print(f"{len(cases)} test cases pass without a fault", flush=True)
        for p, found in zip(apart, pool.map(lambda p: check_fault(bench, p, scratch), apart)):
            report(p, *found)
    print(f"{verdicts.count('caught')} of {len(faults)} caught")
    return 2 if "BROKEN" in verdicts else 1 if "MISSED" in verdicts else 0


if __name__ == "__main__":
    sys.exit(main())
