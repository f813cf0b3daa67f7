#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The README's C++ is examples/render_scan.cpp, which the build compiles and ctest runs."""
import pathlib
import re
import sys

root = pathlib.Path(__file__).resolve().parents[2]
readme = (root / "README.md").read_text(encoding="utf-8")
blocks = re.findall(r"```cpp\n(.*?)```", readme, re.S)
example = (root / "examples" / "render_scan.cpp").read_text(encoding="utf-8")
wanted = "".join(line for line in example.splitlines(True) if "SPDX" not in line)
if blocks != [wanted]:
    sys.exit("README.md: the C++ block differs from examples/render_scan.cpp")
print("README.md shows examples/render_scan.cpp")
