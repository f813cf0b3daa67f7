#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that objects compiled for one instruction set share no function and no variable with any other object.

usage: check_lane_objects.py NM OBJECT...       objects of backends/openmp/src/lane_kernels_isa.cpp
       check_lane_objects.py NM --self-test CXX compile an object that leaks a function and expect to find it

A linker keeps one copy of a function that several objects define. Where that copy was compiled for AVX-512, it ends
the program on a processor that has none. A variable that several objects define may be
initialised by the code of any of them. So every function and variable that such an object defines for others, strong
(T, D, B, R, G, S), weak (W, V) or unique (u, i), has the name of its instruction set in its own.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

# What compilers add to every object: two calls and nothing else (clang), the address of a function of the C++ library.
HARMLESS = {"__clang_call_terminate", "DW.ref.__gxx_personality_v0"}
# UBSan compares the types of functions that are called. Type information is data, and the same in every object.
TYPE_INFO = ("typeinfo for ", "typeinfo name for ")
TAG = re.compile(r"gsnav::lanes::(\w+)::")
LEAK = """
namespace gsnav {
inline int shared(int a) { return a + 1; }
int begin();
inline int variable = begin();
template <class T>
struct Table {
  static T values[4];
};
template <class T>
T Table<T>::values[4] = {1, 2, 3, 4};
namespace lanes::avx2 {
int own(int a) { return shared(a) + variable + Table<int>::values[a]; }
int table[4] = {};
}
}
"""


def defined(nm, path):
    """Demangled names of the functions and variables that an object defines for other objects."""
    text = subprocess.run([nm, "-C", "--defined-only", str(path)], check=True, capture_output=True, text=True).stdout
    return re.findall(r"^[0-9a-f]* [TDBRGSWViu] (.*)$", text, re.MULTILINE)


def leaks(nm, path):
    names = defined(nm, path)
    tags = set(tag for name in names for tag in TAG.findall(name))
    if len(tags) != 1:
        return [f"functions of {len(tags)} instruction sets: {', '.join(sorted(tags)) or 'none'}"]
    tag = tags.pop()
    own = f"gsnav::lanes::{tag}::"
    # nm leaves names with lambdas in lambdas mangled: these begin with the namespace that they are in.
    mangled = f"_ZN5gsnav5lanes{len(tag)}{tag}"
    return [name for name in names
            if own not in name and not name.startswith(mangled) and name not in HARMLESS
            and not name.startswith(TYPE_INFO)]


def self_test(nm, cxx):
    with tempfile.TemporaryDirectory() as folder:
        source, compiled = pathlib.Path(folder, "leak.cpp"), pathlib.Path(folder, "leak.o")
        source.write_text(LEAK)
        subprocess.run([cxx, "-std=c++20", "-O0", "-c", str(source), "-o", str(compiled)], check=True)
        found = leaks(nm, compiled)
        expected = ["gsnav::shared(int)", "gsnav::Table<int>::values", "gsnav::variable"]
        # The guard of `variable`'s initialisation is one more.
        if not set(expected) <= set(found) or any("own" in name or "::table" in name for name in found):
            sys.exit(f"found {found}, not {expected}")


def main():
    nm = sys.argv[1]
    if sys.argv[2] == "--self-test":
        self_test(nm, sys.argv[3])
        return
    failed = False
    for path in sys.argv[2:]:
        for name in leaks(nm, path):
            failed = True
            print(f"{path}: defines {name}, which another instruction set's object may define too. "
                  "Mark it GSNAV_HD, or GSNAV_INLINED if it is a lambda (include/gsnav/config.hpp).")
    sys.exit(1 if failed else 0)


main()
