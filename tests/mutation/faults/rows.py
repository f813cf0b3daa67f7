# SPDX-License-Identifier: Apache-2.0
"""What rows of a file become, and where in the world they lie."""
from . import EVERY, fault

ROWS = "tests/hard_cases/test_rows.cpp"
WORLD = "tests/hard_cases/test_world.cpp"
ORACLE = "tests/eval/test_oracle_contract.cpp"
PLY_TEST = "tests/io/test_ply.cpp"
PLY_COLUMNS = "src/io/ply_columns.cpp"
PLY_READER = ("src/io/ply.cpp", PLY_COLUMNS, "src/io/ply_body.cpp", "src/io/ply_header.cpp",
              "src/io/ply_compressed.cpp",
              "src/io/ply_points.cpp", "src/io/neighbours.cpp", "src/io/file.cpp")

FINITE = "  bool finite = is_finite(raw.mean) && !std::isnan(raw.opacity_logit);\n"
UNIT = ("  Quat<S> n{q.w / m, q.x / m, q.y / m, q.z / m};\n"
        "  q = n * (S(1) / sqrt(dot(n, n)));\n")
ZERO = "  if (!normalize(quat)) return RowFate::zero_quat;\n"
SIGMOID = "1.0 / (1.0 + std::exp(-x))"
LIMITED = "const double limited = std::isinf(s) && s < 0 ? s : clamp(s, -20.0, 20.0);"

FAULTS = [
    fault("quat_unscaled", "normalize", UNIT, "  q = q * (S(1) / sqrt(dot(q, q)));\n",
          ROWS, "N31_quat_tiny", "N32_quat_denormal_nan", why="squares vanish and overflow"),
    fault("quat_epsilon", "normalize", UNIT, "  q = q * (S(1) / sqrt(dot(q, q) + S(1e-8)));\n",
          ROWS, "N31_quat_tiny", why="Habitat-GS: a quaternion of 1e-4 comes out 0.71 long"),
    fault("quat_as_stored", "activate", "  Quatd quat = raw.quat;\n  if (!normalize(quat)) return",
          "  Quatd quat = raw.quat, unit = quat;\n  if (!normalize(unit)) return",
          ROWS, "N31_quat_tiny", why="INRIA's rasteriser does not normalise"),
    fault("quat_zero_kept", "activate", ZERO, "  if (!normalize(quat)) quat = Quatd{};\n",
          ROWS, "N30_quat_zero", "N32_quat_denormal_nan", why="rows never written become blobs"),
    fault("quat_nan_kept", "normalize",
          "if (!(m > S(0)) || !is_finite(q.w) || !is_finite(q.x) || !is_finite(q.y) || !is_finite(q.z)) {",
          "if (!(m > S(0)) || !is_finite(m)) {",
          ROWS, "N32_quat_denormal_nan", why="the largest component of NaN and 1 is 1"),
    fault("zero_rows_of_a_file_kept", "activate", ZERO, "  if (!normalize(quat)) quat = Quatd{};\n",
          PLY_TEST, "N37_truncated_ply_zero_rows", more=PLY_READER),
    fault("mirror_keeps_odd_bands", "transform",
          "      if (k >= 3 && k < 8) continue;\n", "      if (k < 15) continue;\n",
          "tests/io/test_edit_cloud.cpp", "a cloud that is mirrored and stretched is seen as in the mirror",
          more=PLY_READER, why="a mirror is no rotation"),
    fault("nan_position_kept", "activate", FINITE, "  bool finite = !std::isnan(raw.opacity_logit);\n",
          PLY_TEST, "N35_nan_position_row", more=PLY_READER),
    fault("nan_sh_kept", "activate",
          "  for (std::size_t k = 0; k < rest; ++k) finite = finite && is_finite(raw.shN[k]);\n", "",
          PLY_TEST, "N35_nan_position_row", why="one NaN poisons every pixel it is blended into",
          more=PLY_READER),
    fault("nan_row_out_of_all_but_sh", "bands", "cloud_.shN.data() + rest_ * at_;",
          "cloud_.shN.data() + rest_ * (first_ + report_.read - 1);",
          PLY_TEST, "N35_nan_position_row", why="openvdb: all rows after it have another row's SH",
          more=PLY_READER),
    fault("f_rest_colour_inner", "choose_ply_columns",
          'const std::string name = "f_rest_" + std::to_string(channel * (c.rest_in_file / 3) + k);',
          'const std::string name = "f_rest_" + std::to_string(3 * k + channel);',
          PLY_TEST, "N36_sh_degree_mismatch", why="INRIA's files hold a channel after the other",
          more=PLY_READER),
    fault("log_scale_unlimited", "activate", LIMITED, "const double limited = s;",
          ROWS, "N33_logscale_extreme", why="exp(88.8) is infinite in float"),
    fault("log_scale_minus_infinity_limited", "activate", LIMITED,
          "const double limited = clamp(s, -20.0, 20.0);",
          ROWS, "N33_logscale_extreme", why="a flat axis is legal"),
    fault("log_scale_nan_limited", "finite", "finite = finite && !std::isnan(raw.log_scales[k]) &&",
          "finite = finite &&", ROWS, "N33_logscale_extreme"),
    fault("sigmoid_of_growing_exp", "sigmoid", SIGMOID,
          "std::exp(x) / (1.0 + std::exp(x))",
          ROWS, "N34_opacity_inf", why="infinity over infinity"),
    fault("opacity_infinity_dropped", "activate", FINITE,
          "  bool finite = is_finite(raw.mean) && is_finite(raw.opacity_logit);\n",
          ROWS, "N34_opacity_inf"),
    fault("opacity_nan_kept", "activate", FINITE, "  bool finite = is_finite(raw.mean);\n",
          ROWS, "N34_opacity_inf"),
    fault("transparent_kept", "activate", "if (out.opacity < static_cast<float>(kAlphaMin)) return",
          "if (out.opacity < 0.0f) return", ROWS, "N34_opacity_inf"),
    fault("world_in_float", "id_of",
          "origin[k] = kOriginLattice * std::nearbyint(mean[k] / kOriginLattice);", "origin[k] = 0;",
          WORLD, "N28_world_1e6", why="62 mm at 1000 km"),
    fault("camera_offset_in_float", "origin_offset",
          "  return (table.empty() ? Vec3d{} : table[o]) - args.camera64.position;\n",
          "  return vec_cast<double>(vec_cast<float>(table.empty() ? Vec3d{} : table[o]) -\n"
          "                          vec_cast<float>(args.camera64.position));\n",
          WORLD, "N28_world_1e6", why="a difference of two large floats", on=EVERY),
    fault("eye_in_the_world", "position_in", "return inverse(world_from_asset) * position();", "return position();",
          WORLD, "N28_world_1e6", on=EVERY, why="the offset of an asset that is placed elsewhere"),
    fault("cell_of_the_first", "push",
          "      cloud.origin_ids.push_back(id);\n",
          "      cloud.origin_ids.push_back(id > 1 ? 1u : id);\n",
          WORLD, "N29_chunk_boundary"),
    fault("rotation_before_the_factor", "encoding", "return axes.empty() ? ShapeEncoding::ellipsoids",
          "return axes.empty() || !quats.empty() ? ShapeEncoding::ellipsoids",
          ORACLE, "oracle: factors replace rotations and scales, as in the renderer",
          why="an oracle that asks the renderer how rows are stored agrees with it"),
    fault("band_of_a_code", "packed_band", "k < 9 ? 1 : 2", "k < 8 ? 1 : 2",
          ORACLE, "oracle: codes and halves are read as renderers read them"),
    fault("cells_of_the_first_file", "append", "a.origin_ids.push_back(shift + id);", "a.origin_ids.push_back(id);",
          WORLD, "N29_chunk_boundary"),
]
