# SPDX-License-Identifier: Apache-2.0
"""What is seen from where."""
from . import fault

VISIBLE_TEST = "tests/lod/test_visible_sets.cpp"
DRAWN = "rows that may be seen are drawn*"
RUNS = "visible sets: rows in runs*"
WALL = "visible sets: what is behind a wall*"
WEIGHTS = "row weights: the same bits*"
WEIGH_TEST = "tests/ops/test_cuda_weigh.cpp"
SHARES = "cuda weigh: shares of light*"
SETS_ON_GPU = "visible sets: found on a GPU*"

FAULTS = [
    fault("rows_of_lanes_all_seen", "bits",
          "lane_bits(projected.splat.visible) & place.wanted;", "lane_bits(projected.splat.visible);",
          VISIBLE_TEST, DRAWN),
    fault("rows_one_by_one_all_seen", "for_each_candidate",
          "if (seen.has(i - begin)) f(i);", "f(i);", VISIBLE_TEST, DRAWN),
    fault("rows_of_the_next_chunk", "before",
          "seen[chunk / 32] & ((1u << (chunk % 32)) - 1u);", "seen[chunk / 32] & ((2u << (chunk % 32)) - 1u);",
          VISIBLE_TEST, DRAWN),
    fault("second_half_of_a_part_forgotten", "any_of_part",
          "return (word(2 * part) | word(2 * part + 1)) != 0;", "return word(2 * part) != 0;", VISIBLE_TEST, DRAWN),
    fault("rows_by_themselves", "whole_groups",
          "if ((some[k] & first << r) != 0) groups |= first << r;", "groups |= some[k] & first << r;",
          VISIBLE_TEST, RUNS, why="what lies together is seen together"),
    fault("seen_rows_in_one_word", "heavy_rows", "out[r / 32] |= 1u << (r % 32)", "out[0] |= 1u << (r % 32)",
          VISIBLE_TEST, WALL),
    fault("a_chunk_by_its_last_viewpoint", "add",
          "    for (std::size_t k = 0; k < kSeenRowWords; ++k) to[k] |= rows[k];\n", "    to = rows;\n",
          VISIBLE_TEST, "visible sets: a further viewpoint*", why="the last that looked counts alone"),
    fault("weights_of_the_last_block", "blend_list",
          "weights_[j] = max(weights_[j], open - state.transmittance);", "weights_[j] = open - state.transmittance;",
          VISIBLE_TEST, WEIGHTS, why="the largest weight is wanted, not that of the block that comes last"),
    fault("weights_of_viewpoints_before", "look_from",
          "worker.most.assign(set_.gaussians.size(), 0.0f);", "worker.most.resize(set_.gaussians.size());",
          VISIBLE_TEST, WALL, why="a thread looks from many viewpoints, one after the other"),
    fault("viewpoints_share_their_rows", "SeenFromViewpoints::look", "rows_[k]", "rows_[0]", VISIBLE_TEST, WALL),
    fault("viewpoints_share_their_rows_on_a_gpu", "find_rows", "w.rows[k][chunk]", "w.rows[0][chunk]",
          WEIGH_TEST, SETS_ON_GPU, device=True),
    fault("weights_of_the_first_lane", "weigh_kernel", "weight = largest_of_warp(weight);", "", WEIGH_TEST, SHARES,
          device=True),
    fault("weights_of_another_group", "weigh_kernel", "camera / to.cameras_of_group", "0", WEIGH_TEST, SHARES,
          device=True, why="cameras of one viewpoint share their weights, those of two do not"),
    fault("weights_of_an_earlier_call", "enqueue",
          "backend.fill(shares.most, 0, groups * shares.rows * sizeof(float));", "(void)groups;",
          WEIGH_TEST, SHARES, device=True),
    fault("weights_until_half_is_left", "set_raster", "images.rgb8 != nullptr || shares.most != nullptr",
          "images.rgb8 != nullptr", WEIGH_TEST, SHARES, device=True,
          why="pixels stay open, although there are no images"),
]
