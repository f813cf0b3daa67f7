# SPDX-License-Identifier: Apache-2.0
"""Blending a pixel's stack, and its depths."""
from . import plant

BLEND = "include/gsnav/kernels/blend.hpp"
DEPTH = "include/gsnav/kernels/depth.hpp"
PROJECTION = "include/gsnav/kernels/projection.hpp"
STACK_TEST = "tests/hard_cases/test_stack.cpp"
DEPTH_TEST = "tests/hard_cases/test_depth.cpp"
CUT_TEST = "tests/hard_cases/test_determinism.cpp"

OPEN = "transmittance >= L(rules.transmittance_min)"
WEIGHT = "L weight = select(drawn, alpha * before, zero);"
DRAWN = "return exponent >= L(rules.log2_alpha_min);"
LANES = "include/gsnav/kernels/lanes/rasterize_tile.hpp"
DELTA = "  const L defined = select(denominator > L(S(0)), delta, L(S(0)));\n"
CLAMPED = "return L(d.z) + clamp(defined, -reach, reach);"
CROSSES = "select(falls_through(step.before, step.after, kMedianLevel<S>), z, median)"
FIRST = "select(falls_through(step.before, step.after, S(1) - first_hit_tau), z, first_hit)"
RETURNED = "const auto returned = alpha > L(args.rules.return_alpha);"

PLANTS = [
    plant("stop_exclusive", BLEND, WEIGHT,
          "L weight = select(drawn && (before - alpha * before >= L(rules.transmittance_min)), alpha * before, zero);",
          STACK_TEST, "N42_saturation_stop", why="INRIA, gsplat: up to 0.0099 of what lies behind"),
    plant("stop_dropped", BLEND, OPEN, "transmittance >= L(S(0))",
          STACK_TEST, "N42_saturation_stop", "N44_deep_stack"),
    plant("stop_by_the_block", BLEND, "blend_drawn<Color, D, General>(state, rules, state.open(rules), ",
          "blend_drawn<Color, D, General>(state, rules, mask_of<L>(any(state.open(rules))), ",
          CUT_TEST, "N63_determinism_100 of work that is cut",
          why="a closed pixel goes on while its neighbours are open"),
    plant("stop_at_a_hundredth", BLEND, OPEN,
          "transmittance >= L(rules.transmittance_min * S(100))",
          STACK_TEST, "N42_saturation_stop", "N44_deep_stack"),
    plant("alpha_threshold_skipped", BLEND, DRAWN, "return exponent >= L(S(-120));",
          STACK_TEST, "N43_faint_fog", why="training used it: the image has to"),
    plant("alpha_threshold_moved", BLEND, DRAWN,
          "return exponent >= L(rules.log2_alpha_min + S(0.01));",
          STACK_TEST, "N43_faint_fog", why="0.7 % above 1/255"),
    plant("alpha_not_limited", BLEND, "return min(alpha, largest);", "return alpha;",
          STACK_TEST, "N41_single_opaque"),
    plant("exp2_cubic", "include/gsnav/ops/render.hpp",
          "config.profile == Profile::fast ? Exp2::degree3 : Exp2::degree5", "Exp2::degree3",
          "tests/hard_cases/test_response.cpp", "N01_ewa_offaxis_grid", why="off by 1e-4 of alpha"),
    plant("color_summed_in_half", BLEND, "      this->r = fma(step.weight, c.x, this->r);\n",
          "      this->r = fma(step.weight, c.x, this->r);\n"
          "      const L split = this->r * L(scalar_of<L>(8193));\n"
          "      this->r = split - (split - this->r);\n",
          STACK_TEST, "N44_deep_stack", why="11 bits of each sum"),
    plant("depth_sum_from_the_camera", BLEND,
          "    z_ref = select((step.before >= L(S(1))) && (step.weight > L(S(0))), z, z_ref);\n", "",
          DEPTH_TEST, "N47_depth_far"),
    plant("depth_reference_of_the_last", BLEND,
          "select((step.before >= L(S(1))) && (step.weight > L(S(0))), z, z_ref)",
          "select(step.weight > L(S(0)), z, z_ref)",
          DEPTH_TEST, "N45_depth_definitions", "N47_depth_far"),
    plant("depth_of_the_centre", PROJECTION, "  if (camera.compat != Compat::none) return d;\n", "  return d;\n",
          DEPTH_TEST, "N46_depth_tilted_disk", "N47_depth_far", why="wrong by decimetres on tilted disks"),
    plant("depth_not_clamped", DEPTH, CLAMPED, "return L(d.z) + defined;",
          DEPTH_TEST, "N46_depth_tilted_disk", why="flat disks run past their extent, and behind the camera"),
    plant("depth_clamped_at_3_sigma", PROJECTION, "d.reach = sqrt(L(S(2 * kLn2)) * p.s_max) *", "d.reach = L(S(3)) *",
          DEPTH_TEST, "N46_depth_tilted_disk"),
    plant("depth_of_edge_on_divided", DEPTH, DELTA, "  const L defined = delta;\n",
          "tests/hard_cases/test_determinant.cpp", "N06_det_flat_edge_on", why="0 / 0"),
    plant("median_of_the_last", BLEND, CROSSES, "select(step.after <= L(kMedianLevel<S>), z, median)",
          DEPTH_TEST, "N45_depth_definitions"),
    plant("median_before_the_crossing", BLEND, CROSSES, "select(step.before > L(kMedianLevel<S>), z, median)",
          DEPTH_TEST, "N48_depth_no_return", why="a pixel that stays half open has no median"),
    plant("median_alone_from_the_centre", BLEND,
          "return ray_depth(*depth, px, py); });",
          "return D == DepthMode::median ? L(depth->z) : ray_depth(*depth, px, py); });",
          DEPTH_TEST, "N70_depth_only_equals_rgbd"),
    plant("median_alone_at_another_t", BLEND,
          "falls_through(step.before, step.after, kMedianLevel<scalar_of<L>>);",
          "falls_through(step.before, step.after, scalar_of<L>(0.49));",
          DEPTH_TEST, "N70_depth_only_equals_rgbd"),
    plant("median_by_number_at_another_t", BLEND, "select(before > L(kMedianLevel<scalar_of<L>>), met, last)",
          "select(before > L(scalar_of<L>(0.49)), met, last)",
          DEPTH_TEST, "N70_depth_only_equals_rgbd"),
    plant("lists_filled_up_with_a_splat", LANES, "list[i] = kNothing;", "list[i] = list[0];",
          CUT_TEST, "N63_determinism_100 of work that is cut"),
    plant("first_hit_of_the_last", BLEND, FIRST, "select(step.after <= L(S(1) - first_hit_tau), z, first_hit)",
          DEPTH_TEST, "N45_depth_definitions"),
    plant("first_hit_before_the_crossing", BLEND, FIRST, "select(step.before > L(S(1) - first_hit_tau), z, first_hit)",
          DEPTH_TEST, "N45_depth_definitions", "N48_depth_no_return"),
    plant("expected_not_divided", BLEND,
          "state.accumulated / select(returned, alpha, one) + state.z_ref",
          "fma(alpha, state.z_ref, state.accumulated)",
          DEPTH_TEST, "N45_depth_definitions", "N48_depth_no_return", why="drawn towards the camera by what is clear"),
    plant("accumulated_without_reference", BLEND, "fma(pixel_alpha(state), state.z_ref, state.accumulated);",
          "state.accumulated;", DEPTH_TEST, "N45_depth_definitions"),
    plant("alpha_image_of_transmittance", BLEND, "return pixel_alpha(state);\n", "return abs(state.transmittance);\n",
          STACK_TEST, "N41_single_opaque"),
    plant("expected_image_accumulated", BLEND, "return pixel_expected_depth(args, state);\n",
          "return pixel_accumulated_depth(state);\n", DEPTH_TEST, "N45_depth_definitions"),
    plant("empty_pixel_divided", BLEND, RETURNED, "const mask_of<L> returned(true);",
          DEPTH_TEST, "N48_depth_no_return", why="0 / 0 where nothing is"),
    plant("return_alpha_ignored", BLEND, RETURNED, "const auto returned = alpha > zero;",
          DEPTH_TEST, "N48_depth_no_return"),
    plant("behind_ends_the_chunk", "include/gsnav/kernels/project_chunk.hpp",
          "        if (seen.has(i - begin) && project_gaussian(args, base + written, i)) ++written;\n",
          "        if (!project_gaussian(args, base + written, i)) break;\n        ++written;\n",
          CUT_TEST, "N65_cull_invariance"),
    plant("behind_ends_the_chunk_of_lanes", "include/gsnav/kernels/lanes/project_chunk.hpp",
          "    if (!any(z > F(camera.near_plane))) continue;\n",
          "    if (!any(z > F(camera.near_plane))) break;\n",
          CUT_TEST, "N65_cull_invariance"),
    plant("culled_by_the_centre", PROJECTION,
          "(out.center_x + out.half_width >= half) &&", "(out.center_x >= half) &&",
          "tests/hard_cases/test_footprint.cpp", "N11_tile_cover_conservative",
          why="what reaches in from beyond the border is lost"),
    plant("tiles_appended_by_thread", "include/gsnav/kernels/tiles.hpp",
          "      for (std::size_t b = 0; b < args.blocks; ++b) {\n        std::uint64_t& c = args.cursors[b",
          "      for (std::size_t b = args.blocks; b-- > 0;) {\n        std::uint64_t& c = args.cursors[b",
          CUT_TEST, "N63_determinism_100 of work that is cut", why="whoever is first, as atomics do it"),
]
