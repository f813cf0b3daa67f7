# SPDX-License-Identifier: Apache-2.0
"""How files are written, and what a PLY keeps of a cloud."""
from . import Edit, Plant, plant

FILE = "include/gsnav/core/replace_file.hpp"
FILE_TEST = "tests/io/test_replace_file.cpp"
PLY_SAVE = "src/io/ply_save.cpp"
PLY_SAVE_TEST = "tests/io/test_ply_save.cpp"
PLY = tuple(f"src/io/{name}.cpp" for name in (
    "ply_save", "cloud_check", "ply", "ply_columns", "ply_body", "ply_header", "ply_compressed", "ply_points",
    "neighbours", "file"))

PLANTS = [
    plant("written_in_place", FILE, "      fd = open_aside();\n",
          "      in_place_ = true;\n"
          "      fd = ::open(target_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0666);\n",
          FILE_TEST, "*kill -9*", "*file larger than the process may write*", "*or throws*",
          why="what was there is gone before the new file is whole"),
    Plant("one_name_aside",
          (Edit(FILE, "std::to_string(next++)", "std::to_string(next)"),
           Edit(FILE, "O_TMPFILE | O_WRONLY | O_CLOEXEC", "-1"),
           Edit(FILE, "O_CREAT | O_EXCL | O_WRONLY", "O_CREAT | O_WRONLY")),
          FILE_TEST, ("*threads that write one name*",), why="two threads write into one file"),
    plant("device_replaced", FILE, "if (exists && !S_ISREG(old.st_mode)) {", "if (false) {",
          FILE_TEST, "*devices and pipes*", why="a pipe becomes a file"),
    plant("rows_along_the_curve", PLY_SAVE, "const std::size_t i = order[row];", "const std::size_t i = row;",
          PLY_SAVE_TEST, "*order in which they were read*", more=PLY,
          why="ties of depth are drawn in another order: 42 dB"),
    plant("logit_of_one_infinite", PLY_SAVE, "if (opacity >= 1) return kOpaque;",
          "if (opacity > 1) return kOpaque;", PLY_SAVE_TEST, "*every logit is finite*", why="trainers get NaN", more=PLY),
    plant("rounded_quat_as_it_is", PLY_SAVE, "  if (normalised(unit) == unit) return unit;\n",
          "  if (true) return unit;\n", PLY_SAVE_TEST, "*quaternions come back bit for bit*", more=PLY,
          why="one in a hundred is another when it is normalised again"),
]
