# SPDX-License-Identifier: Apache-2.0
"""Skinning, poses between keys, and shapes that are no rotated ellipsoids'."""
from . import BACKENDS, BY_TILES, fault

SKIN_TEST = "tests/hard_cases/test_skin.cpp"
POSE_TEST = "tests/hard_cases/test_pose.cpp"
FACTOR_TEST = "tests/hard_cases/test_factor.cpp"
FACTOR_DET = "N62_psd_factor: det > 0 and accurate, whatever the factor"
FACTOR_IMAGES = "N62_psd_factor in images"

POLAR = "  const Quat<L> turn = quat_direction(scaled_polar_rotation(blend.linear)), turned = turn * quat;\n"
USABLE = "> L(static_cast<S>(kMinBlendDeterminant));"
SHORT = ("  if (c < S(0)) {\n"
         "    b = -b;\n"
         "    c = -c;\n"
         "  }\n")

FAULTS = [
    fault("skin_gram_schmidt", "skin", POLAR,
          """  const Mat3<L> posed = blend.linear * rotation_matrix(quat);
  Vec3<L> c0 = posed.column(0), c1 = posed.column(1);
  c0 = c0 * (L(S(1)) / norm(c0));
  c1 = c1 - c0 * dot(c0, c1);
  c1 = c1 * (L(S(1)) / norm(c1));
  const Quat<L> turned = quat_direction(ScaledRotation<L>{transpose(Mat3<L>{{c0, c1, cross(c0, c1)}}), L(S(1))});
  const Quat<L> turn = turned * conjugate(quat);
""",
          SKIN_TEST, "N57_polar_equivariance", "N58_polar_vs_svd",
          why="Habitat-GS: depends on how the ellipsoid's axes are numbered"),
    fault("skin_blend_as_rotation", "skin", POLAR,
          "  const Quat<L> turn = quat_direction(ScaledRotation<L>{blend.linear, L(S(1))}), turned = turn * quat;\n",
          SKIN_TEST, "N58_polar_vs_svd"),
    fault("skin_greatest_joint", "usable", USABLE, "> L(S(2));", SKIN_TEST, "N58_polar_vs_svd"),
    fault("polar_one_step", "scaled_polar_rotation", "step < 32", "step < 1", SKIN_TEST, "N58_polar_vs_svd"),
    fault("polar_two_steps", "scaled_polar_rotation", "step < 32", "step < 2", SKIN_TEST, "N58_polar_vs_svd"),
    fault("polar_stops_early", "scaled_polar_rotation", "S(1e-9) : S(2e-4)", "S(1e-2) : S(1e-2)", SKIN_TEST,
          "N58_polar_vs_svd"),
    fault("polar_lanes_go_on", "sum", "sum = select(active, sum - change, sum);", "sum = sum - change;",
          SKIN_TEST, "N58_polar_vs_svd", why="a result that hangs on a Gaussian's neighbours"),
    fault("candy_wrapper_kept", "usable", USABLE, "> L(S(-1));",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd"),
    fault("quaternion_by_the_trace", "quat_direction",
          "  take(ix, {wx, ix, xy, xz});\n  take(iy, {wy, xy, iy, yz});\n  take(iz, {wz, xz, yz, iz});\n", "",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd", why="cancels towards 180 degrees"),
    fault("positions_by_the_rotation", "skin",
          "moved(blend.linear,", "moved(polar_rotation(blend.linear),",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd", why="positions are the trainer's: linear"),
    fault("weights_of_eight_bits", "skinning_weight", "static_cast<S>(parts) * static_cast<S>(1.0 / kWeightParts)",
          "static_cast<S>((parts + 128) / 257) / static_cast<S>(255)",
          SKIN_TEST, "N54_lbs_identity", "N58_polar_vs_svd"),
    fault("influences_the_last_left_out", "blend_influences", "for (int k = 1; k < count; ++k) sum",
          "for (int k = 1; k < count - 1; ++k) sum",
          SKIN_TEST, "N54_lbs_identity", on=BACKENDS),
    fault("parent_after_the_joint", "joint_global", "local : globals[static_cast<std::size_t>(parent)] * local;",
          "local : local * globals[static_cast<std::size_t>(parent)];",
          "tests/avatar/test_motion.cpp", "between keys joints turn and bones keep their length"),
    fault("parent_after_the_joint_in_crowds", "joint_global",
          "local : globals[static_cast<std::size_t>(parent)] * local;",
          "local : local * globals[static_cast<std::size_t>(parent)];",
          SKIN_TEST, "joints that turn carry*", on=BACKENDS),
    fault("weights_rounded_down", "round_weights", "    parts[j] = static_cast<std::uint16_t>(exact);\n",
          "    parts[j] = static_cast<std::uint16_t>(exact);\n    if (j + 1 == k) left = parts[j];\n",
          SKIN_TEST, "N55_lbs_rigid_far", why="Habitat-GS: the sum's error times the distance from zero"),
    fault("weights_rest_to_the_greatest", "round_weights", "++parts[order[j % k]];", "++parts[0];",
          "tests/avatar/test_lbs.cpp",
          "rounded weights make 1 and move a point by at most K / 4 parts of its joints' distance"),
    fault("skinned_in_the_world", "prepare_levels",
          "    actor.to_joint_matrices(matrices_);\n",
          """    actor.to_joint_matrices(matrices_);
    const Similarity place = std::exchange(world_, Similarity{});
    for (auto& m : matrices_) m = Affine3<double>{rotation_matrix(place.rotation), place.translation} * m;
""",
          SKIN_TEST, "N55_lbs_rigid_far", why="float's step at 1000 m, and the weights' sum times 1000 m"),
    fault("quaternion_of_a_matrix_by_the_trace", "quat_from_matrix", "  if (trace > S(0)) {\n",
          "  if (trace > S(-2)) {\n",
          "tests/math/test_quat.cpp", "rotations by 180 degrees survive the way through a matrix"),
    fault("nlerp", "slerp", "  if (c > S(0.9999999)) {\n", "  if (c > S(-2)) {\n",
          POSE_TEST, "N60_slerp_vs_lerp", why="the same path at another speed"),
    fault("slerp_the_long_way", "slerp", SHORT, "", POSE_TEST, "N60_slerp_vs_lerp"),
    fault("matrices_mixed", "blend_keys",
          "out.rotations[j] = slerp(clip.rotations[a * n + j], clip.rotations[b * n + j], u);",
          "out.rotations[j] = quat_from_matrix(rotation_matrix(clip.rotations[a * n + j]) * (1 - u) +\n"
          "                                          rotation_matrix(clip.rotations[b * n + j]) * u);",
          POSE_TEST, "N60_slerp_vs_lerp"),
    fault("mirrored_joint_taken", "clip_from_matrices", "!(determinant(m.linear) > kMinBlendDeterminant)",
          "!(abs(determinant(m.linear)) > kMinBlendDeterminant)",
          "tests/avatar/test_motion.cpp", "joint matrices become a clip that gives them back",
          why="Newton's iteration keeps the determinant's sign"),
    fault("cofactors_by_plain_products", "difference_of_products",
          "  return fma(a, b, -cd) + error;\n", "  return (a * b - cd) + error * L(0);\n",
          FACTOR_TEST, FACTOR_DET, why="no image is as exact"),
    fault("factor_det_ac_minus_b2", "project",
          "const L det = fma(h, (a0 + c0) + h, det0);",
          "const L det = (a0 + h) * (c0 + h) - b0 * b0;",
          FACTOR_TEST, FACTOR_DET),
    fault("factor_area_signed", "project",
          "const L det0 = dot(area, area);", "const L det0 = dot(area, area) * select(dot(m.row[0], "
          "axes.cofactors.row[0]) < L(S(0)), L(S(-1)), L(S(1)));",
          FACTOR_TEST, FACTOR_IMAGES, why="a mirrored factor has a covariance too", on=BY_TILES),
]
