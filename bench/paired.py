#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Times versions of gsnav next to each other on one machine: all draw one view, then all draw the next.

    bench/paired.py --size 256x256 --threads 2 OLD:rgb/fast NEW:rgb/fast NEW:rgb/exact

OLD and NEW are programs made of bench/bench_engine.cpp, or others with its protocol. The scene is that
of GSNAV_BENCH_SCENE and GSNAV_BENCH_CAMERAS. `@` before OUTPUT/PROFILE draws all views in one call.

A view counts with its least time of all rounds, since other programs only slow a frame down. Rows are
compared with the first one, and rows with `@` with the first of those. A printed row has:
- the median time over views, milliseconds per frame;
- how many times faster it is: the median over views, and the quartiles;
- how many of its images have the same bits.
"""
import argparse
import os
import statistics
import subprocess


class Engine:
    """A program that draws frames on request."""

    def __init__(self, program, options):
        command = [program, *options.size.split("x"), str(options.threads)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.views = int(self.answer("views")[0])

    def answer(self, word):
        """The value after `word` in the next line that starts with it."""
        for line in self.process.stdout:
            if line.startswith(word + " "):
                return line.split()[1:]
        raise SystemExit(f"paired.py: {self.process.args[0]} ended without `{word}`")

    def draw(self, what, view):
        """Milliseconds per frame, and a hash of the images if the program prints one."""
        self.process.stdin.write(f"{what} {view}\n")
        self.process.stdin.flush()
        ms, *image = self.answer("ms")
        return float(ms), image


def quartiles(values):
    return statistics.quantiles(values, n=4) if len(values) > 1 else values * 3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", nargs="+", metavar="PROGRAM:OUTPUT/PROFILE")
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--every", type=int, default=1, help="draw every n-th view")
    options = parser.parse_args()
    names = [row.rpartition(":")[::2] for row in options.rows]
    for row, (program, what) in zip(options.rows, names):
        if "/" not in what or not os.access(program, os.X_OK):
            parser.error(f"{row}: must be a program that exists, `:`, and an output and a profile such as rgb/fast")
    engines = {program: None for program, _ in names}
    for program in engines:
        engines[program] = Engine(os.path.abspath(program), options)
    views = next(iter(engines.values())).views
    least, images = {row: {} for row in options.rows}, {}
    for batch in (False, True):
        rows = [(row, program, what) for row, (program, what) in zip(options.rows, names)
                if what.startswith("@") == batch]
        for number in range(options.rounds + 1 if rows else 0):
            for view in [-1] if batch else range(0, views, options.every):
                for row, program, what in rows:
                    ms, image = engines[program].draw(what.removeprefix("@"), view)
                    images.setdefault((row, view), image)
                    if number > 0:  # the first round warms up
                        least[row][view] = min(ms, least[row].get(view, ms))
    first = {}
    for row, (_, what) in zip(options.rows, names):
        top = first.setdefault(what.startswith("@"), row)
        same = sum(images[row, view] == images[top, view] != [] for view in least[row])
        low, middle, high = quartiles([least[top][view] / ms for view, ms in least[row].items()])
        print(f"{row:48} {statistics.median(least[row].values()):8.3f} ms {middle:7.3f}x ({low:.3f} to {high:.3f})"
              f" {same:4} images of {len(least[row])} equal")


if __name__ == "__main__":
    main()
