#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that objects compiled for one instruction set share no function with any other object.

usage: check_lane_objects.py NM OBJECT...       objects of backends/openmp/src/lane_kernels_isa.cpp
       check_lane_objects.py NM --self-test CXX compile an object that leaks a function and expect to find it

A linker keeps one copy of a function that several objects define. Where that copy was compiled for AVX-512, it ends
the program on a processor that has none. So every function that such an object defines for others has the name of its
instruction set in its own.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

# Two calls and nothing else, which clang adds to every object with noexcept functions.
HARMLESS = {"__clang_call_terminate"}
TAG = re.compile(r"gsnav::lanes::(\w+)::")
LEAK = """
namespace gsnav {
inline int shared(int a) { return a + 1; }
namespace lanes::avx2 {
int own(int a) { return shared(a); }
}
}
"""


def functions(nm, path):
    """Demangled names of the functions that an object defines for other objects."""
    text = subprocess.run([nm, "-C", "--defined-only", str(path)], check=True, capture_output=True, text=True).stdout
    return re.findall(r"^[0-9a-f]* [TWi] (.*)$", text, re.MULTILINE)


def leaks(nm, path):
    names = functions(nm, path)
    tags = set(tag for name in names for tag in TAG.findall(name))
    if len(tags) != 1:
        return [f"functions of {len(tags)} instruction sets: {', '.join(sorted(tags)) or 'none'}"]
    tag = tags.pop()
    own = f"gsnav::lanes::{tag}::"
    # nm leaves names with lambdas in lambdas mangled: these begin with the namespace that they are in.
    mangled = f"_ZN5gsnav5lanes{len(tag)}{tag}"
    return [name for name in names
            if own not in name and not name.startswith(mangled) and name not in HARMLESS]


def self_test(nm, cxx):
    with tempfile.TemporaryDirectory() as folder:
        source, compiled = pathlib.Path(folder, "leak.cpp"), pathlib.Path(folder, "leak.o")
        source.write_text(LEAK)
        subprocess.run([cxx, "-std=c++20", "-O0", "-c", str(source), "-o", str(compiled)], check=True)
        found = leaks(nm, compiled)
        if found != ["gsnav::shared(int)"]:
            sys.exit(f"the planted leak was not found: {found}")


def main():
    nm = sys.argv[1]
    if sys.argv[2] == "--self-test":
        self_test(nm, sys.argv[3])
        return
    failed = False
    for path in sys.argv[2:]:
        for name in leaks(nm, path):
            failed = True
            print(f"{path}: defines {name}, which another instruction set's object may define too. Mark it GSNAV_HD, or "
                  "GSNAV_INLINED if it is a lambda (include/gsnav/config.hpp).")
    sys.exit(1 if failed else 0)


main()
