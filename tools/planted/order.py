# SPDX-License-Identifier: Apache-2.0
"""Footprints, keys and order."""
from . import plant

PROJECTION = "include/gsnav/detail/frame/projection.hpp"
CHUNK = "include/gsnav/detail/frame/project_chunk.hpp"
ROW = "include/gsnav/detail/frame/project_row.hpp"
TILES = "include/gsnav/detail/frame/tiles.hpp"
STRIPS = "include/gsnav/detail/frame/footprint.hpp"
FOOTPRINT = "tests/hard_cases/test_footprint.cpp"
ORDER = "tests/hard_cases/test_order.cpp"
KEYS = "tests/hard_cases/test_keys.cpp"

PLANTS = [
    plant("three_sigma_box", PROJECTION,
          "    const L radius = sqrt(max(out.s_max, L(S(0))));\n",
          "    const L radius(S(3 * kWhitenScale));\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="3 sigma is less than alpha = 1/255 of an opaque Gaussian"),
    plant("mean_radius_box", PROJECTION,
          "out.half_width = fma(radius / out.a, L(S(1.00001)), pad_x);",
          "out.half_width = fma(radius * sqrt(L(S(0.5)) * (big_a + big_c)) * L(S(1.0 / kWhitenScale)), "
          "L(S(1.00001)), pad_x);",
          FOOTPRINT, "N11_tile_cover_conservative"),
    plant("strip_edges_only", STRIPS,
          "    const L y_right = select(negative_k_, at_k, against_k);\n"
          "    const L y_left = select(negative_k_, against_k, at_k);\n",
          "    const L y_right = select(negative_k_, high, low);\n"
          "    const L y_left = select(negative_k_, low, high);\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="the widest point of an ellipse may lie inside the strip"),
    plant("strip_turned_wrong", STRIPS,
          "    const L y_right = select(negative_k_, at_k, against_k);\n",
          "    const L y_right = select(negative_k_, against_k, at_k);\n",
          FOOTPRINT, "N11_tile_cover_conservative"),
    plant("cull_by_means", "include/gsnav/detail/frame/cull.hpp",
          "    const double reach = f * bounds.scale_max * sqrt(1 + limit * limit);\n",
          "    const double reach = 0 * f * bounds.scale_max * sqrt(1 + limit * limit);\n",
          "tests/hard_cases/test_culling.cpp", "N65_cull_invariance of chunks in space",
          why="a Gaussian beside the image reaches into it"),
    plant("slice_of_the_middle", "include/gsnav/detail/render/depth_slices.hpp",
          "      place.bucket = static_cast<std::uint16_t>(std::min(bucket, kBuckets - 1));\n",
          "      place.bucket = static_cast<std::uint16_t>(std::min(bucket + 2, kBuckets - 1));\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance of slices of depth",
          why="a chunk's nearest Gaussian comes before its middle"),
    plant("extent_without_footprints", "include/gsnav/detail/frame/cull.hpp",
          "    const double left = -chunk.largest(axis * -f) - wide, right = chunk.largest(axis * f) + wide;\n",
          "    const double left = -chunk.largest(axis * -f), right = chunk.largest(axis * f);\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance needs bounds that hold*",
          why="a hidden mean may have a footprint that is not"),
    plant("open_by_the_mean", "include/gsnav/detail/lanes/write_splats.hpp",
          "    if (open.any(cell(0), cell(1), cell(2), cell(3))) found |= 1u << l;\n",
          "    if (open.any(cell(0), cell(1), cell(0) + 1, cell(1) + 1)) found |= 1u << l;\n",
          "tests/hard_cases/test_slices.cpp", "N65_cull_invariance of slices of depth"),
    plant("ties_in_sorted_order", "include/gsnav/detail/render/order_visible.hpp",
          "    heap_sort(order.data + i, end - i);\n", "",
          "tests/hard_cases/test_culling.cpp", "N21_depth_ties_keep_file_order when rows are sorted in space"),
    plant("perspective_box_centred", PROJECTION,
          "  out.center_x = select(ellipse, center_x, zero);\n"
          "  out.center_y = select(ellipse, center_y, zero);\n",
          "  out.center_x = select(ellipse, out.mean_x, zero);\n"
          "  out.center_y = select(ellipse, out.mean_y, zero);\n",
          FOOTPRINT, "N11_tile_cover_conservative",
          why="under perspective the mean is a focus, not the centre"),
    plant("key_rounded_early", PROJECTION,
          "  return dot(Vec3<D>{D(row.x), D(row.y), D(row.z)}, delta) * D(camera.scale);\n",
          "  const Mat3<float> r = mat_cast<float>(camera.rotation);\n"
          "  return dot(Vec3<D>{D(r(2, 0)), D(r(2, 1)), D(r(2, 2))}, delta) * D(camera.scale);\n",
          ORDER, "N22_depth_tie_grid", why="a float32 rotation moves keys by several of their roundings"),
    plant("key_in_float", ROW,
          "  return {delta64, mean + row.rounded_offset(offset), static_cast<F>(depth_key(camera, delta64))};\n",
          "  const Mat3<float> r = mat_cast<float>(camera.rotation);\n"
          "  const Vec3<F> delta = mean + row.rounded_offset(offset);\n"
          "  const F z = dot(Vec3<F>{F(r(2, 0)), F(r(2, 1)), F(r(2, 2))}, delta) * F(static_cast<float>(camera.scale));\n"
          "  return {delta64, delta, z};\n",
          ORDER, "N77_quantised_capture*", "N79_near_ties*", why="the chain in float32 swaps near ties"),
    plant("reference_key_in_float", CHUNK,
          "    key.z = static_cast<float>(position.z * args.camera.scale);\n",
          "    key.z = dot(vec_cast<float>(args.camera.rotation.row[2]), key.delta);\n",
          ORDER, "N77_quantised_capture*", why="a reference with the kernels' fault would hide it"),
    plant("visible_by_another_expression", ROW,
          "        splat(project<L, F>(camera, axes, key.z, ",
          "        splat(project<L, F>(camera, axes, static_cast<F>(axes.position.z * L(1.0000001f)), ",
          "tests/hard_cases/test_near.cpp", "N16_near_plane_cross"),
    plant("key_top_bits", "include/gsnav/detail/frame/projection_camera.hpp",
          "    const std::uint32_t code = (bits > base ? bits - base : 0u) >> shift;",
          "    const std::uint32_t code = largest == 0xffffffffu ? bits : bits >> 16;",
          ORDER, "N23_key_wide_range", why="bits spent on depths that no scene has"),
    plant("key_below_near", "include/gsnav/detail/frame/projection_camera.hpp",
          "    const std::uint32_t code = (bits > base ? bits - base : 0u) >> shift;",
          "    const std::uint32_t code = (bits - base) >> shift;",
          ORDER, "N23_key_wide_range", why="the nearest Gaussian comes last"),
    plant("ties_reversed", "include/gsnav/detail/render/order_visible.hpp",
          "      for (std::uint32_t i = 0; i < n; ++i) f(k[i] - base, slot + i);\n",
          "      for (std::uint32_t i = n; i-- > 0;) f(k[i] - base, slot + i);\n",
          ORDER, "N21_depth_tie_stack", "N22_depth_tie_grid"),
    plant("ties_dropped", "include/gsnav/detail/render/order_visible.hpp",
          "        for (std::uint32_t i = 0; i < n; ++i) f(k[i] - base, slot + i);",
          "        for (std::uint32_t i = 0; i < n; ++i) f(i > 0 && k[i] == k[i - 1] ? 0xffffffffu : k[i] - base, slot + i);",
          ORDER, "N22_depth_tie_grid"),
    plant("last_tile_of_a_row_lost", TILES,
          "tx1 = (b.x1 - 1) >> shift", "tx1 = (b.x1 - 2) >> shift",
          FOOTPRINT, "N11_tile_cover_conservative"),
    plant("background_forgotten", "include/gsnav/detail/frame/blend.hpp",
          "return {fma(t, L(args.background.x), state.r),", "return {state.r,",
          KEYS, "N26_pair_count_zero"),
]
