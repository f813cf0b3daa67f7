#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that no source file has more than 350 lines and no function more than 80.

usage: check_sizes.py              check this source tree
       check_sizes.py --self-test  check that long functions are found
Files that are longer today are listed with what they have: they may shrink, not grow, and no file joins them.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).parents[1]
MOST_LINES, MOST_OF_FUNCTION = 350, 80
SOURCES = {".hpp", ".cpp", ".cu", ".cuh", ".h", ".inl"}
LONG_FILES = {
    "backends/cuda/emulated/blocks.cpp": 423,
    "backends/cuda/emulated/runtime.cpp": 362,
    "backends/cuda/src/batch_order.cuh": 379,
    "backends/cuda/src/mesh.cu": 427,
    "bench/bench_kernels_body.cpp": 379,
    "bench/floor_loops.cpp": 360,
    "include/gsnav/detail/lanes/rasterize_tile.hpp": 363,
    "src/io/avatar_file.cpp": 360,
}
LONG_FUNCTIONS = {
    "backends/cuda/src/batch_project.cu": 149,
    "bench/bench_storage.cpp": 92,
    "include/gsnav/detail/scene/lod_levels.hpp": 86,
    "include/gsnav/detail/sim/semantic_frame.hpp": 86,
    "include/gsnav/sweep/capsule.hpp": 93,
    "src/rigging/capsule_volume.cpp": 99,
    "src/rigging/clip_walk.cpp": 103,
    "src/rigging/retarget.cpp": 111,
    "src/nav/field_cells.cpp": 103,
    "src/nav/gaussian_navmesh.cpp": 107,
    "src/nav/step.cpp": 84,
    "src/nav/unfolded_mesh.cpp": 101,
    "tools/avatar/walk.cpp": 85,
}
NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)
NO_FUNCTION = re.compile(r"(template *<.*> *)?(inline )?(namespace|class|struct|enum|union|extern)\b", re.DOTALL)


def functions(text):
    """(first line, lines, head) of each function body; what is inside of one counts as its own."""
    # Digits have separators that look like quotes.
    code = re.sub(r"(?<=[0-9a-fA-F])'(?=[0-9a-fA-F])", " ", text)
    code = NO_CODE.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), code)
    code = re.sub(r"(?m)^ *#.*(\\\n.*)*", lambda m: "\n" * m.group().count("\n"), code)
    found, open_braces, begin = [], [], 0
    inside = False  # of a function
    for at, char in enumerate(code):
        if char == "{":
            head = code[begin:at].strip()
            body = not inside and "(" in head and not NO_FUNCTION.match(head)
            open_braces.append((at, body, head))
            inside = inside or body
            begin = at + 1
        elif char == "}":
            if not open_braces:
                continue
            start, body, head = open_braces.pop()
            if body:
                inside = False
                first = code.count("\n", 0, start) + 1
                found.append((first, code.count("\n", start, at) + 1, " ".join(head.split())))
            begin = at + 1
        elif char == ";":
            begin = at + 1
    return found


def check(root):
    wrong, files = [], 0
    for top in ("include", "src", "backends", "tools", "bench"):
        for file in sorted(p for p in (root / top).rglob("*") if p.suffix in SOURCES):
            files += 1
            name, text = file.relative_to(root).as_posix(), file.read_text(encoding="utf-8")
            lines, most = text.count("\n"), LONG_FILES.get(name, MOST_LINES)
            if lines > most:
                wrong.append(f"{name}: {lines} lines, more than {most}")
            most = LONG_FUNCTIONS.get(name, MOST_OF_FUNCTION)
            wrong += [f"{name}:{first}: {n} lines in one function, more than {most}: {head[-60:]}"
                      for first, n, head in functions(text) if n > most]
    return files, wrong


def self_test():
    body = "  f();\n" * 80
    for head in ("int f() ", "struct A {\n A() : a_{}, b_(0) ", "template <class T>\nvoid f(T x)\n  requires true ",
                 "namespace n {\nclass B {\n  bool operator()(char c = '\\'') const "):
        # A brace in a string or a comment is none.
        if not any(n > MOST_OF_FUNCTION for _, n, _ in functions(head + '{  // {\n  g("{");\n' + body + "}\n}\n")):
            sys.exit(f"not found: {head}")
    methods = "  int f() { return 1; }\n" * 90
    if any(n > MOST_OF_FUNCTION for _, n, _ in functions("namespace n {\nstruct A {\n" + methods + "};\n}\n")):
        sys.exit("a class was taken for a function")
    print("long functions are found")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    else:
        checked, violations = check(ROOT)
        print("\n".join(violations) or f"{checked} files are short")
        sys.exit(1 if violations or not checked else 0)
