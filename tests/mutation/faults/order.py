# SPDX-License-Identifier: Apache-2.0
"""Footprints, keys and order."""
from . import fault

FOOTPRINT = "tests/hard_cases/test_footprint.cpp"
ORDER = "tests/hard_cases/test_order.cpp"
KEYS = "tests/hard_cases/test_keys.cpp"
CULLING = "tests/hard_cases/test_culling.cpp"
EACH = ("serial", "openmp")

FAULTS = [
    fault("three_sigma_box", "project",
          "    const L radius = sqrt(max(out.s_max, L(S(0))));\n",
          "    const L radius(S(3 * kWhitenScale));\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="3 sigma is less than alpha = 1/255 of an opaque Gaussian"),
    fault("mean_radius_box", "project",
          "out.half_width = fma(radius / out.a, L(S(1.00001)), pad_x);",
          "out.half_width = fma(radius * sqrt(L(S(0.5)) * (big_a + big_c)) * L(S(1.0 / kWhitenScale)), "
          "L(S(1.00001)), pad_x);",
          FOOTPRINT, "N11_tile_cover_conservative"),
    fault("strip_edges_only", "columns",
          "    const L y_right = select(negative_k_, at_k, against_k);\n"
          "    const L y_left = select(negative_k_, against_k, at_k);\n",
          "    const L y_right = select(negative_k_, high, low);\n"
          "    const L y_left = select(negative_k_, low, high);\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="the widest point of an ellipse may lie inside the strip"),
    fault("strip_turned_wrong", "columns",
          "    const L y_right = select(negative_k_, at_k, against_k);\n",
          "    const L y_right = select(negative_k_, against_k, at_k);\n",
          FOOTPRINT, "N11_tile_cover_conservative"),
    fault("cull_by_means", "reach",
          "    const double reach = f * bounds.scale_max * sqrt(1 + limit * limit);\n",
          "    const double reach = 0 * f * bounds.scale_max * sqrt(1 + limit * limit);\n",
          CULLING, "N65_cull_invariance of chunks in space",
          why="a Gaussian beside the image reaches into it"),
    fault("slice_of_the_middle", "place_of",
          "      place.bucket = static_cast<std::uint16_t>(std::min(bucket, kBuckets - 1));\n",
          "      place.bucket = static_cast<std::uint16_t>(std::min(bucket + 2, kBuckets - 1));\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance of slices of depth",
          why="a chunk's nearest Gaussian comes before its middle"),
    fault("extent_without_footprints", "chunk_extent",
          "    const double left = -chunk.largest(axis * -f) - wide, right = chunk.largest(axis * f) + wide;\n",
          "    const double left = -chunk.largest(axis * -f), right = chunk.largest(axis * f);\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance needs bounds that hold*",
          why="a hidden mean may have a footprint that is not"),
    fault("open_by_the_mean", "reaching_open",
          "    if (open.any(cell(0), cell(1), cell(2), cell(3))) found |= 1u << l;\n",
          "    if (open.any(cell(0), cell(1), cell(0) + 1, cell(1) + 1)) found |= 1u << l;\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance of slices of depth"),
    fault("ties_in_sorted_order", "RankTies",
          "    heap_sort(order.data + i, end - i);\n", "",
          CULLING, "N21_depth_ties_keep_file_order when rows are sorted in space"),
    fault("perspective_box_centred", "add_perspective",
          "  out.center_x = select(ellipse, center_x, zero);\n"
          "  out.center_y = select(ellipse, center_y, zero);\n",
          "  out.center_x = select(ellipse, out.mean_x, zero);\n"
          "  out.center_y = select(ellipse, out.mean_y, zero);\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="under perspective the mean is a focus, not the centre"),
    fault("key_rounded_early", "depth_key",
          "  return dot(Vec3<D>{D(row.x), D(row.y), D(row.z)}, delta) * D(camera.scale);\n",
          "  const Mat3<float> r = mat_cast<float>(camera.rotation);\n"
          "  return dot(Vec3<D>{D(r(2, 0)), D(r(2, 1)), D(r(2, 2))}, delta) * D(camera.scale);\n",
          ORDER, "N22_depth_tie_grid", why="a float32 rotation moves keys by several of their roundings"),
    fault("key_in_float", "row_key",
          "  return {delta64, mean + row.rounded_offset(offset), static_cast<F>(depth_key(camera, delta64))};\n",
          "  const Mat3<float> r = mat_cast<float>(camera.rotation);\n"
          "  const Vec3<F> delta = mean + row.rounded_offset(offset);\n"
          "  const F z = dot(Vec3<F>{F(r(2, 0)), F(r(2, 1)), F(r(2, 2))}, delta) * "
          "F(static_cast<float>(camera.scale));\n"
          "  return {delta64, delta, z};\n",
          ORDER, "N77_quantised_capture*", "N79_near_ties*", why="the chain in float32 swaps near ties"),
    fault("reference_key_in_float", "project_row",
          "    key.z = static_cast<float>(position.z * args.camera.scale);\n",
          "    key.z = dot(vec_cast<float>(args.camera.rotation.row[2]), key.delta);\n",
          ORDER, "N77_quantised_capture*", why="a reference with the kernels' fault would hide it"),
    fault("visible_by_another_expression", "ProjectedRow",
          "        splat(project<L, F>(camera, axes, key.z, ",
          "        splat(project<L, F>(camera, axes, static_cast<F>(axes.position.z * L(1.0000001f)), ",
          "tests/hard_cases/test_near.cpp", "N16_near_plane_cross"),
    fault("key_top_bits", "KeyCode",
          "    const std::uint32_t code = (bits > base ? bits - base : 0u) >> shift;",
          "    const std::uint32_t code = largest == 0xffffffffu ? bits : bits >> 16;",
          ORDER, "N23_key_wide_range", why="bits spent on depths that no scene has"),
    fault("key_below_near", "KeyCode",
          "    const std::uint32_t code = (bits > base ? bits - base : 0u) >> shift;",
          "    const std::uint32_t code = (bits - base) >> shift;",
          ORDER, "N23_key_wide_range", why="the nearest Gaussian comes last"),
    fault("ties_reversed", "for_each",
          "      for (std::uint32_t i = 0; i < n; ++i) f(k[i] - base, slot + i);\n",
          "      for (std::uint32_t i = n; i-- > 0;) f(k[i] - base, slot + i);\n",
          ORDER, "N21_depth_tie_stack", "N22_depth_tie_grid"),
    fault("ties_dropped", "for_each",
          "        for (std::uint32_t i = 0; i < n; ++i) f(k[i] - base, slot + i);",
          "        for (std::uint32_t i = 0; i < n; ++i) f(i > 0 && k[i] == k[i - 1] ? 0xffffffffu : k[i] - "
          "base, slot + i);",
          ORDER, "N22_depth_tie_grid"),
    fault("last_tile_of_a_row_lost", "of",
          "tile_of(box.x1 - one)", "tile_of(box.x1 - one - one)",
          FOOTPRINT, "N11_tile_cover_conservative"),
    fault("distance_of_the_asset", "distance_key", "norm(delta) * D(camera.scale)", "norm(delta)",
          ORDER, "N22_depth_tie_grid", why="an asset that is placed larger is farther away, too"),
    fault("last_pixel_of_a_box_lost", "pixel_range", "select(l > last, l - one, l) + one",
          "select(l > last, l - one, l)",
          ORDER, "N22_depth_tie_grid", on=EACH),
    fault("rank_of_the_stored_row", "ViewedSet::rank_of",
          "(gaussians.row_ids.empty() ? row : gaussians.row_ids[row])", "row",
          CULLING, "N21_depth_ties_keep_file_order when rows are sorted in space", on=EACH),
    fault("ranks_of_lanes_by_the_stored_row", "ranks_of", "args.rank_of(rows[l] < last ? rows[l] : last)",
          "args.first_rank + (rows[l] < last ? rows[l] : last)",
          CULLING, "N21_depth_ties_keep_file_order when rows are sorted in space", on=("openmp",)),
    fault("background_forgotten", "pixel_color",
          "return {fma(t, L(args.background.x), state.r),", "return {state.r,",
          KEYS, "N26_pair_count_zero"),
]
