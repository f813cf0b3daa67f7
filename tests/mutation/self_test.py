#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Whether a program that holds many faults at once prints, with each of them, what the program with that edit prints.

    tests/mutation/self_test.py [--cxx COMPILER]
"""
import argparse
import collections
import os
import pathlib
import subprocess
import sys
import tempfile

from faults import Edit, Fault
from sources import Sources, place_of
from switches import HEADER, HEADER_TEXT, VARIABLE, Switched

PROGRAM = """#include <cstdio>
constexpr int kConstant = 3;
enum class Kind { one, two };
struct Pair {
  template <class T>
  Pair(T x, T y) : a(x + 1), b(static_cast<int>(y)) {}
  int sum() const noexcept { return a + b; }
  int later = 4;
  int a, b;
};
template <class T> constexpr T twice(T x) { return x + x; }
int plain(int x) { return x * 3; }
int governed(int x) {
  for (int i = 0; i < 3; ++i) x += i;
  if (x > 7) return x; else x = -x;
  while (x < -20) x += 5;
  return x;
}
int declared(int x) {
  const int a = x + 1, b = x + 2;
  const auto c = static_cast<long>(a) * b;
  int d{x};
  d += static_cast<int>(c);
  const auto inner = [&](int y) -> int { return y - d; };
  return inner(b);
}
int cases(Kind kind, int x) {
  switch (kind) {
    case Kind::one: return x + 10;
    case Kind::two: {
      x = x - 10;
      break;
    }
  }
  return x;
}
const char* named(bool which) { return which ? "yes" : "no"; }
int main() {
  static_assert(twice(4) == 8);
  volatile int two = 2;
  std::printf("%d %d %d\\n", Pair(two, 5).sum(), Pair(two, 7).later, twice(int(two)));
  std::printf("%d %d %d\\n", plain(4), governed(5), governed(-30));
  std::printf("%d %d %d\\n", declared(3), cases(Kind::one, 1), cases(Kind::two, 1));
  std::printf("%s %d\\n", named(true), kConstant);
}
"""

# function, before, after, and the kinds of its forms; without any it needs a copy.
EDITS = [
    ("plain", "return x * 3;", "return x * 4;", ["statements"]),
    ("plain", "return x * 3;", "const int y = x * 5;\nreturn y;", ["statements"]),
    ("governed", "x += i;", "x -= i;", ["statements", "statements"]),
    ("governed", "i < 3", "i < 2", ["condition", "statements", "statements"]),
    ("governed", "x > 7", "x > 9", ["condition", "statements", "statements"]),
    ("governed", "x = -x;", "", ["statements", "statements"]),
    ("governed", "while (x < -20) x += 5;\n  return x;", "return x - 100;", ["statements"]),
    ("declared", "a = x + 1", "a = x + 4", ["value", "statements"]),
    ("declared", "b = x + 2;", "b = x + 9;", ["value", "statements"]),
    ("declared", "static_cast<long>(a) * b", "static_cast<long>(a) - b", ["value", "statements"]),
    ("declared", "int d{x};", "int d{x + 7};", ["statements"]),
    ("declared", "return y - d;", "return d - y;", ["statements", "statements"]),
    ("cases", "return x + 10;", "return x + 11;", ["statements", "statements"]),
    ("cases", "x = x - 10;", "x = x - 12;", ["statements", "statements", "statements"]),
    ("sum", "a + b", "a - b", ["statements"]),
    ("Pair", "a(x + 1)", "a(x + 2)", ["value"]),
    ("twice", "x + x", "x * x - 2 * x", ["statements"]),
    ("named", '"yes"', '"perhaps"', ["statements"]),
    ("kConstant", "kConstant = 3;", "kConstant = 5;", []),
    ("Pair", "int later = 4;", "int later = 5;", []),
]


def output(cxx, folder, file, number=0):
    binary = folder / "program"
    if number == 0:
        subprocess.run([cxx, "-std=c++20", "-w", "-I", folder, "-include", HEADER, file, "-o", binary], check=True)
    return subprocess.run([binary], env={**os.environ, VARIABLE: str(number)}, check=True, capture_output=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cxx", default=os.environ.get("CXX", "c++"))
    args = parser.parse_args()
    faults = [Fault(f"{i}", (Edit(*e[:3]),), "", ()) for i, e in enumerate(EDITS)]
    wrong = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        file = folder / "src/program.cpp"
        file.parent.mkdir()
        file.write_text(PROGRAM)
        (folder / HEADER).write_text(HEADER_TEXT)
        sources, expected = Sources(folder), {}
        unchanged = output(args.cxx, folder, file)
        for fault in faults:
            (_, begin, end), _ = place_of(sources, fault.edits[0])
            file.write_text(PROGRAM[:begin] + fault.edits[0].new + PROGRAM[end:])
            expected[fault.name] = output(args.cxx, folder, file)
        file.write_text(PROGRAM)
        switched = Switched(folder, faults)
        if output(args.cxx, folder, file) != unchanged:
            wrong.append("without a fault the output is another")
        kinds = collections.defaultdict(list)
        for change in switched.changes[file]:
            kinds[switched.names[change.number]] = [f.kind for f in change.forms]
        for fault, (function, old, new, wanted) in zip(faults, EDITS):
            if kinds[fault.name] != wanted:
                wrong.append(f"{function}, {old} => {new}: forms {kinds[fault.name]}, not {wanted}")
            number = switched.numbers.get(fault.name)
            if expected[fault.name] == unchanged:
                wrong.append(f"{function}, {old} => {new}: the edit changes nothing")
            elif number and output(args.cxx, folder, file, number) != expected[fault.name]:
                wrong.append(f"{function}, {old} => {new}: another output than that of the edit")
    print("\n".join(wrong) or f"{len(faults)} edits stand in one program")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
