#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that no file includes a header of a higher layer or of another module of its layer (CONTRIBUTING.md,
"Layout of the repository"). Examples, tools and the report may use only public headers and names: nothing of
detail/ or src/, and no `detail::`. Oracles of images reach no header with code of a kernel, however far away, and
call no function that decodes rows.

usage: check_layers.py [root]      check a source tree (default: this one)
       check_layers.py --self-test seed violations in a scratch tree and expect to find each
"""
import collections
import pathlib
import re
import sys
import tempfile

RANK = {"base": 0, "math": 1, "core": 2, "image": 3, "frame": 4, "skin": 4, "sweep": 4, "mesh": 5, "lanes": 6,
        "render": 6, "scene": 7, "avatar": 7, "nav": 7, "rigging": 8, "io": 8, "interop": 8, "sim": 8,
        "eval": 8, "demo": 9, "device": 9, "open": 10}
# headers that avatar may include too
DATA_ONLY = {"scene/gaussian_cloud.hpp", "scene/load_report.hpp", "scene/surface_material.hpp"}
# Headers that are not standard, but exist on every platform that compiles the code that includes them.
PLATFORM_HEADERS = {"emmintrin.h", "immintrin.h", "arm_neon.h", "fcntl.h", "sched.h", "sys/mman.h", "sys/stat.h",
                    "unistd.h"}
# Oracles of images may reach only the headers FOR_ORACLES of these layers: values, and checks and lists of them.
ORACLES = ("include/gsnav/eval/oracle.hpp", "include/gsnav/detail/eval/oracle_*.hpp", "tests/support/oracle.*")
NOT_FOR_ORACLES = {"image", "frame", "skin", "sweep", "mesh", "lanes", "render", "eval"}
FOR_ORACLES = {"image/camera.hpp", "detail/image/validate_camera.hpp", "frame/gaussians.hpp", "frame/rules.hpp",
               "detail/frame/output.hpp", "render/config.hpp", "detail/render/validate_set.hpp"}
# Functions that decode rows, and how rows are laid out.
ROW_READER = re.compile(r"\b(?:encoding|band_encoding|packed|rest|degree_of|origin_of|origin_id|bytes_of|chunk_count|"
                        r"sh_coefficient_count)\(|\bcloud\.mean\(|\bShapeRows::k|\bkProjectChunk\b")
# modules with a header <module>.hpp that includes their public headers
MODULES = {"render", "avatar", "rigging", "nav", "sim", "io", "eval", "demo", "open", "gsnav"}
# Largest number of public headers: of the library in include/, and of one backend.
MOST_PUBLIC, MOST_PUBLIC_OF_A_BACKEND = 70, 6
SOURCES = {".hpp", ".cpp", ".h", ".inl", ".cu", ".cuh"}
NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"', re.DOTALL)
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def layer_of(path):
    """Layer of a file named from the root: 'include/gsnav/core/view.hpp' is in core."""
    parts = path.parts
    if parts[:2] == ("include", "gsnav"):
        if len(parts) == 3:
            return "umbrella" if path.stem in MODULES else "base"
        return parts[3] if parts[2] == "detail" else parts[2]
    return f"backend {parts[1]}" if parts[0] == "backends" else parts[1]  # src/<layer>


def allowed(layer, target, target_path):
    if layer == target:
        return True
    if layer == "umbrella" or (layer == "device" and target.startswith("backend")):
        return True
    if layer.startswith("backend"):
        return RANK.get(target, 99) <= RANK["render"]
    if layer == "avatar" and target_path in DATA_ONLY:
        return True
    return RANK.get(target, 99) < RANK[layer]


def private(root, file, name):
    """Whether this include of a program names a header that is not public."""
    places = [root / top / name for top in ("include", "src")] + list(root.glob(f"backends/*/{name}"))
    for place in (file.parent / name, *places):
        if place.is_file():
            parts = place.resolve().relative_to(root.resolve()).parts
            return (parts[:3] == ("include", "gsnav", "detail") or parts[0] == "src" or
                    (parts[0] == "backends" and parts[2:3] != ("gsnav",)))
    return name.startswith("gsnav/detail/")


def public_headers(root):
    """Public headers of the library, and those of backends."""
    library = [p for p in (root / "include/gsnav").rglob("*.hpp")
               if p.relative_to(root / "include/gsnav").parts[0] != "detail"]
    return library, [p for p in root.glob("backends/*/gsnav/**/*") if p.suffix in SOURCES]


def check_program(root, file):
    """Includes and names in an example or a tool that are not public."""
    text, path = file.read_text(encoding="utf-8"), file.relative_to(root)
    wrong = [f"{path}: {name} is not for users; its module header is" for _, name in INCLUDE.findall(text)
             if private(root, file, name)]
    code = NO_CODE.sub(lambda m: "\n" * m.group().count("\n"), text)
    return wrong + [f"{path}:{code.count(chr(10), 0, m.start()) + 1}: names in detail are not for users: {m.group()}"
                    for m in re.finditer(r"\b(?:\w+::)*detail::\w+|\bnamespace\b[^;{]*\bdetail\b", code)]


def reached(root, file, seen):
    """Adds to `seen` each header of the project that the file reaches by includes, and the file that includes it."""
    for _, name in INCLUDE.findall(file.read_text(encoding="utf-8")):
        header = next((p for p in (root / "include" / name, root / "tests" / name) if p.is_file()), None)
        if header and header not in seen:
            seen[header] = file
            reached(root, header, seen)
    return seen


def check_oracle(root, file):
    """Headers and functions that an oracle of images shares with kernels."""
    path = file.relative_to(root)
    oracles = {p for pattern in ORACLES for p in root.glob(pattern)}
    wrong = []
    for header, by in reached(root, file, {}).items():
        name = header.relative_to(root)
        if (header not in oracles and layer_of(name) in NOT_FOR_ORACLES and
                name.as_posix().removeprefix("include/gsnav/") not in FOR_ORACLES):
            wrong.append(f"{path}: an oracle may not reach {name} (by {by.relative_to(root)})")
    code = NO_CODE.sub("", file.read_text(encoding="utf-8"))
    return wrong + [f"{path}: an oracle decodes rows by its own code, without {m.group()}"
                    for m in ROW_READER.finditer(code)]


def check(root):
    """Lines 'file: problem', one for each include that is not allowed."""
    wrong = []
    files = [p for top in ("include/gsnav", "src", "backends") for p in sorted((root / top).rglob("*"))
             if p.suffix in SOURCES]
    for file in files:
        path = file.relative_to(root)
        layer = layer_of(path)
        if layer not in RANK and layer != "umbrella" and not layer.startswith("backend"):
            wrong.append(f"{path}: '{layer}' is not a layer")
            continue
        for quote, name in INCLUDE.findall(file.read_text(encoding="utf-8")):
            if name.startswith("gsnav/backends/"):
                target = f"backend {pathlib.PurePath(name.split('/')[2]).stem}"
            elif name.startswith("gsnav/"):
                target = layer_of(pathlib.PurePath("include") / name)
            elif quote == '"' and (file.parent / name).exists():
                target = layer_of((file.parent / name).resolve().relative_to(root.resolve()))
            else:
                public = path.parts[0] == "include" and layer != "interop"
                standard = quote == "<" and re.fullmatch(r"[a-z_0-9]+", name)
                if public and not standard and name not in PLATFORM_HEADERS:
                    wrong.append(f"{path}: a public header includes {name}, which is not standard")
                continue
            if not allowed(layer, target, name.removeprefix("gsnav/").removeprefix("detail/")):
                wrong.append(f"{path}: {layer} may not include {name} ({target})")
    for top in ("examples", "tools", "bench/report"):
        for file in sorted(p for p in (root / top).rglob("*") if p.suffix in SOURCES):
            files.append(file)
            wrong += check_program(root, file)
    for pattern in ORACLES:
        for file in sorted(root.glob(pattern)):
            wrong += check_oracle(root, file)
    library, of_backends = public_headers(root)
    if len(library) > MOST_PUBLIC:
        wrong.append(f"include/gsnav: {len(library)} public headers, more than {MOST_PUBLIC}")
    for backend, count in collections.Counter(path.relative_to(root).parts[1] for path in of_backends).items():
        if count > MOST_PUBLIC_OF_A_BACKEND:
            wrong.append(f"backends/{backend}: {count} public headers, more than {MOST_PUBLIC_OF_A_BACKEND}")
    return files, wrong


def self_test():
    good = {"include/gsnav/config.hpp": "", "include/gsnav/core/view.hpp": '"gsnav/math/vec.hpp"',
            "include/gsnav/avatar/asset.hpp": '"gsnav/scene/gaussian_cloud.hpp"',
            "include/gsnav/interop/eigen.hpp": "<Eigen/Core>", "src/io/a.cpp": "<png.h>",
            "backends/x/gsnav/backends/x.hpp": '"gsnav/render/render.hpp"', "include/gsnav/detail/io/ply.hpp": "",
            "tools/t/own.hpp": '"gsnav/core/view.hpp"', "tools/t/own.cpp": '"../t/own.hpp"',
            "examples/e/says.cpp": "// see gsnav::detail::f and namespace detail\nconst char* a = \"detail::f\";",
            "tools/t/backend.cpp": '"gsnav/backends/x.hpp"', "include/gsnav/detail/eval/plane.hpp": "",
            "include/gsnav/detail/render/loop.hpp": "", "include/gsnav/eval/by.hpp": '"gsnav/detail/render/loop.hpp"',
            "include/gsnav/detail/eval/oracle_own.hpp": '"gsnav/core/view.hpp"'}
    bad = {"include/gsnav/core/up.hpp": '"gsnav/frame/sh.hpp"',
           "include/gsnav/scene/sideways.hpp": '"gsnav/nav/navmesh.hpp"',
           "include/gsnav/avatar/not_data.hpp": '"gsnav/scene/basic_renderer.hpp"',
           "include/gsnav/render/backend.hpp": "<gsnav/backends/serial.hpp>",
           "include/gsnav/scene/library.hpp": "<Eigen/Core>", "tools/t/main.cpp": '"gsnav/detail/io/ply.hpp"',
           "src/sim/makes.cpp": '"gsnav/detail/rigging/retarget.hpp"',
           "src/sim/reads.cpp": '#  include "../io/private.hpp"', "src/io/private.hpp": "",
           "backends/y/gsnav/backends/y.hpp": '"gsnav/backends/x.hpp"',
           "tools/t/relative.cpp": '"../../include/gsnav/detail/io/ply.hpp"',
           "examples/e/source.cpp": '"../../src/io/private.hpp"', "tools/t/source.cpp": '"io/private.hpp"',
           "tools/t/of_backend.cpp": '"../../backends/z/src/z.cpp"',
           "tools/t/calls.cpp": "int a = gsnav::detail::f();", "examples/e/calls.cpp": "int a = detail::f();",
           "bench/report/opens.cpp": "using namespace gsnav::io::detail;",
           "include/gsnav/detail/eval/oracle_by.hpp": '"gsnav/eval/by.hpp"',
           "include/gsnav/detail/eval/oracle_projects.hpp": '"gsnav/detail/image/pinhole.hpp"',
           "include/gsnav/detail/image/pinhole.hpp": "",
           "include/gsnav/detail/eval/oracle_decodes.hpp": "bool b = rows.shape.encoding() == 1;",
           "tests/support/oracle.hpp": '"gsnav/detail/eval/plane.hpp"',
           "backends/z/src/z.cpp": '"gsnav/scene/basic_renderer.hpp"', "src/other/o.cpp": ""}
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch)
        for name, include in {**good, **bad}.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            line = f"#include {include}" if include.startswith(('"', "<")) else include
            (root / name).write_text(line + "\n", encoding="utf-8")
        found = {line.split(":")[0] for line in check(root)[1]}
        expected = set(bad) - {"src/io/private.hpp", "include/gsnav/detail/image/pinhole.hpp"}
        # The number of public headers has a limit.
        for folder, most in (("include/gsnav/core", MOST_PUBLIC), ("backends/x/gsnav/x", MOST_PUBLIC_OF_A_BACKEND)):
            (root / folder).mkdir(parents=True, exist_ok=True)
            for k in range(most + 1):
                (root / folder / f"header{k}.hpp").write_text("\n", encoding="utf-8")
        found |= {line.split(":")[0] for line in check(root)[1]}
    expected |= {"include/gsnav", "backends/x"}
    if found != expected:
        sys.exit(f"missed: {sorted(expected - found)}\nwrongly found: {sorted(found - expected)}")
    print(f"{len(expected)} seeded violations found")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    elif sys.argv[1:2] in (["--help"], ["-h"]):
        print(__doc__)
    else:
        tree = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).parents[1]
        checked, violations = check(tree)
        library, of_backends = map(len, public_headers(tree))
        print("\n".join(violations) or f"{len(checked)} files keep to their layers; public headers: "
              f"{library} of the library, {of_backends} of backends")
        sys.exit(1 if violations or not checked else 0)
