# SPDX-License-Identifier: Apache-2.0
"""Checks many faults on one tree that holds them all (mutate.py --together). Each source is compiled once. A fault that
cannot stand beside the code as it is, or that is not caught in this way, is checked in a copy of its own."""
from __future__ import annotations

import concurrent.futures
import shutil

from bench import binary_of, by_test, fails_unchanged, first_error, judge
from switches import HEADER, Switched


class Together:
    """All tests of some faults, compiled from one tree."""

    def __init__(self, bench, faults, scratch, pool):
        self.bench, self.pool, self.scratch = bench, pool, scratch
        self.tree = scratch / "together"
        shutil.copytree(bench.tree, self.tree)
        self.switched = Switched(self.tree, faults)
        self.device_code: dict[str, str] = {}
        self.tests = []  # the faults of each and its units
        self.objects = {}  # of each unit: a source and its flags
        for some in by_test(faults):
            sources, flags, device_code = bench.parts(some[0])
            self.device_code |= device_code
            units = [(source, tuple(flags)) for source in sources]
            self.tests.append((some, units))
            for unit in units:
                self.objects.setdefault(unit, scratch / f"together.{len(self.objects)}.o")

    def compile(self):
        """Compiles every unit. Faults with which one does not compile leave the tree."""
        uses = {u: sum(u in units for _, units in self.tests) for u in self.objects}
        left = sorted(self.objects, key=lambda u: -uses[u])
        while left:
            self.bench.rewrite(self.tree, self.device_code)
            failed = {u: said for u, said in zip(left, self.pool.map(self._compile, left)) if said}
            blamed = {u: self.switched.blamed(said) for u, said in failed.items()}
            for unit in (u for u in failed if not blamed[u]):
                print(f"{unit[0]}: does not compile: {first_error(failed[unit])}", flush=True)
            left = [u for u in failed if blamed[u]]
            self.switched.try_next(set(sum(blamed.values(), [])))

    def _compile(self, unit):
        source, flags = unit
        return self.bench.compile(self.tree, source, [*flags, "-include", HEADER], self.objects[unit])

    def link(self, test):
        """Links a test and runs its cases without a fault. Returns what is wrong with it, or nothing."""
        some, units = test
        missing = [u for u in units if not self.objects[u].exists()]
        said = f"{missing[0][0]} does not compile" if missing else \
            self.bench.link([self.objects[u] for u in units], binary_of(some[0], self.scratch))
        return said or ", ".join(fails_unchanged(self.bench, some, binary_of(some[0], self.scratch)))


def check_together(bench, faults, scratch, pool, report):
    """Reports each fault that is caught in a tree that holds them all. Returns the others: each needs a copy."""
    together = Together(bench, faults, scratch, pool)
    together.compile()
    numbers = together.switched.numbers
    for name, why in together.switched.out.items():
        print(f"{name:32} apart   {why}", flush=True)
    good = []
    for test, wrong in zip(together.tests, pool.map(together.link, together.tests)):
        good += [] if wrong else [f for f in test[0] if f.name in numbers]
        if wrong:
            print(f"{test[0][0].source}: apart: {wrong}", flush=True)
    print(f"{len(good)} of {len(faults)} faults stand in one tree; without a fault their cases pass", flush=True)
    runs = {pool.submit(judge, bench, f, binary_of(f, scratch), numbers[f.name]): f for f in good}
    caught = set()
    for run in concurrent.futures.as_completed(runs):
        verdict, remark = run.result()
        if verdict == "caught":
            caught.add(runs[run].name)
            report(runs[run], verdict, remark)
        else:
            print(f"{runs[run].name:32} apart   {verdict}: {remark}", flush=True)
    return [f for f in faults if f.name not in caught]
