# SPDX-License-Identifier: Apache-2.0
"""How files are written, and what a PLY keeps of a cloud."""
from . import Edit, Fault, fault

FILE_TEST = "tests/io/test_replace_file.cpp"
PLY_SAVE_TEST = "tests/io/test_ply_save.cpp"
PLY = tuple(f"src/io/{name}.cpp" for name in (
    "ply_save", "cloud_check", "ply", "ply_columns", "ply_body", "ply_header", "ply_compressed", "ply_points",
    "neighbours", "file"))

FAULTS = [
    fault("written_in_place", "fd", "      fd = open_aside();\n",
          "      in_place_ = true;\n"
          "      fd = ::open(target_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0666);\n",
          FILE_TEST, "*kill -9*", "*file larger than the process may write*", "*or throws*",
          why="what was there is gone before the new file is whole"),
    Fault("one_name_aside",
          (Edit("unique_name", "std::to_string(next++)", "std::to_string(next)"),
           Edit("fd", "O_TMPFILE | O_WRONLY | O_CLOEXEC", "-1"),
           Edit("open_aside", "O_CREAT | O_EXCL | O_WRONLY", "O_CREAT | O_WRONLY")),
          FILE_TEST, ("*threads that write one name*",), why="two threads write into one file"),
    fault("name_not_on_disk", "commit",
          "      if (!in_place_) error_ = detail::sync_folder(detail::folder_of(target_));\n",
          "", FILE_TEST, "*a new name is on the disk*", why="a crash of the machine takes the new file's name back"),
    fault("row_not_on_disk", "append_line", "::fdatasync(fd) != 0", "false", FILE_TEST, "*append_line*",
          why="a crash of the machine loses finished episodes"),
    fault("device_replaced", "open", "if (exists && !S_ISREG(old.st_mode)) {", "if (false) {",
          FILE_TEST, "*devices and pipes*", why="a pipe becomes a file"),
    fault("rows_along_the_curve", "save_ply", "const std::size_t i = order[row];", "const std::size_t i = row;",
          PLY_SAVE_TEST, "*order in which they were read*", more=PLY,
          why="ties of depth are drawn in another order: 42 dB"),
    fault("logit_of_one_infinite", "logit_of", "if (opacity >= 1) return kOpaque;",
          "if (opacity > 1) return kOpaque;", PLY_SAVE_TEST, "*every logit is finite*", why="trainers get NaN",
          more=PLY),
    fault("rounded_quat_as_it_is", "stored_quat", "  if (normalised(unit) == unit) return unit;\n",
          "  if (true) return unit;\n", PLY_SAVE_TEST, "*quaternions come back bit for bit*", more=PLY,
          why="one in a hundred is another when it is normalised again"),
]
