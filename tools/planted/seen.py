# SPDX-License-Identifier: Apache-2.0
"""What is seen from where."""
from . import plant

VISIBLE_TEST = "tests/lod/test_visible_sets.cpp"
GAUSSIANS = "include/gsnav/frame/gaussians.hpp"
SETS = "include/gsnav/scene/visible_sets.hpp"
DRAWN = "rows that may be seen are drawn*"
RUNS = "visible sets: rows in runs*"

PLANTS = [
    plant("rows_of_lanes_all_seen", "include/gsnav/detail/lanes/project_chunk.hpp",
          "lane_bits(seen.splat.visible) & wanted & ", "lane_bits(seen.splat.visible) & ", VISIBLE_TEST, DRAWN),
    plant("rows_one_by_one_all_seen", "include/gsnav/detail/frame/project_chunk.hpp",
          "if (seen.has(i - begin) && project_gaussian(", "if (project_gaussian(", VISIBLE_TEST, DRAWN),
    plant("rows_of_the_next_chunk", GAUSSIANS,
          "seen[chunk / 32] & ((1u << (chunk % 32)) - 1u);", "seen[chunk / 32] & ((2u << (chunk % 32)) - 1u);",
          VISIBLE_TEST, DRAWN),
    plant("second_half_of_a_part_forgotten", GAUSSIANS,
          "return (word(2 * part) | word(2 * part + 1)) != 0;", "return word(2 * part) != 0;", VISIBLE_TEST, DRAWN),
    plant("rows_by_themselves", SETS, "    if (any) continue;\n    for (std::size_t r = first; r < first + run; ++r) out",
          "    for (std::size_t r = first; r < first + run; ++r)\n      if (begin + r >= most.size() || "
          "!(static_cast<double>(most[begin + r]) > settings.min_weight)) out",
          VISIBLE_TEST, RUNS, why="what lies together is seen together"),
    plant("a_chunk_by_its_last_viewpoint", SETS,
          "    for (std::size_t k = 0; k < kSeenRowWords; ++k) to[k] |= rows[k];\n", "    to = rows;\n",
          VISIBLE_TEST, "visible sets: a further viewpoint*", why="the last that looked counts alone"),
]
