# SPDX-License-Identifier: Apache-2.0
"""Skinning, poses between keys, and shapes that are no rotated ellipsoids'."""
from . import plant

LBS = "include/gsnav/kernels/lbs.hpp"
QUAT = "include/gsnav/math/quat.hpp"
MOTION = "include/gsnav/avatar/motion.hpp"
SKIN_TEST = "tests/hard_cases/test_skin.cpp"
POSE_TEST = "tests/hard_cases/test_pose.cpp"
FACTOR_TEST = "tests/hard_cases/test_factor.cpp"

POLAR = "  out.rotation = quat_from_rotation(polar_rotation(blend));\n"
USABLE = "determinant(blend) > L(static_cast<S>(kMinBlendDeterminant));"
SHORT = ("  if (c < S(0)) {\n"
         "    b = -b;\n"
         "    c = -c;\n"
         "  }\n")

PLANTS = [
    plant("skin_gram_schmidt", LBS, POLAR + "  out.quat = out.rotation * quat;\n",
          """  const Mat3<L> posed = blend * rotation_matrix(quat);
  Vec3<L> c0 = posed.column(0), c1 = posed.column(1);
  c0 = c0 * (L(S(1)) / norm(c0));
  c1 = c1 - c0 * dot(c0, c1);
  c1 = c1 * (L(S(1)) / norm(c1));
  out.quat = quat_from_rotation(transpose(Mat3<L>{{c0, c1, cross(c0, c1)}}));
  out.rotation = out.quat * conjugate(quat);
""",
          SKIN_TEST, "N57_polar_equivariance", "N58_polar_vs_svd",
          why="Habitat-GS: depends on how the ellipsoid's axes are numbered"),
    plant("skin_blend_as_rotation", LBS, POLAR, "  out.rotation = quat_from_rotation(blend);\n",
          SKIN_TEST, "N58_polar_vs_svd"),
    plant("skin_greatest_joint", LBS, "select(usable, blend(i, j), joints[0].linear(i, j))",
          "joints[0].linear(i, j)",
          SKIN_TEST, "N58_polar_vs_svd"),
    plant("polar_one_step", LBS, "step < 16", "step < 1", SKIN_TEST, "N58_polar_vs_svd"),
    plant("polar_three_steps", LBS, "step < 16", "step < 3", SKIN_TEST, "N58_polar_vs_svd"),
    plant("polar_stops_early", LBS, "S(1e-16) : S(1e-7)", "S(1e-3) : S(1e-3)", SKIN_TEST, "N58_polar_vs_svd"),
    plant("polar_lanes_go_on", LBS,
          "      x.row[i] = {select(active, next.x, x.row[i].x), select(active, next.y, x.row[i].y),\n"
          "                  select(active, next.z, x.row[i].z)};\n",
          "      x.row[i] = next;\n",
          SKIN_TEST, "N58_polar_vs_svd", why="a result that hangs on a Gaussian's neighbours"),
    plant("candy_wrapper_kept", LBS, USABLE, "determinant(blend) > L(S(-1));",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd"),
    plant("quaternion_by_the_trace", LBS,
          "  take(ix, {wx, ix, xy, xz});\n  take(iy, {wy, xy, iy, yz});\n  take(iz, {wz, xz, yz, iz});\n", "",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd", why="cancels towards 180 degrees"),
    plant("positions_by_the_rotation", LBS,
          "    const Vec3<L>& r = blend.row[i];\n    out.mean[i]",
          "    const Mat3<L> turn = polar_rotation(blend);\n    const Vec3<L>& r = turn.row[i];\n    out.mean[i]",
          SKIN_TEST, "N56_lbs_candy_180", "N58_polar_vs_svd", why="positions are the trainer's: linear"),
    plant("weights_of_eight_bits", LBS, "weights[k] = static_cast<S>(args.weights[4 * i + k]);",
          "weights[k] = S(static_cast<int>(args.weights[4 * i + k] * 255.0f + 0.5f)) / S(255);",
          SKIN_TEST, "N54_lbs_identity", "N58_polar_vs_svd"),
    plant("weights_not_renormalised", "include/gsnav/avatar/asset.hpp",
          "static_cast<float>(j == 0 ? rest : static_cast<double>(weights[i * k + order[j]]) / kept)",
          "weights[i * k + order[j]]",
          SKIN_TEST, "N55_lbs_rigid_far", why="Habitat-GS: the sum's error times the distance from zero"),
    plant("skinned_in_the_world", "include/gsnav/avatar/skinned_gaussians.hpp",
          "    set_.world_from_asset = actor.placement(t);\n    actor.joint_matrices(t, matrices_);\n",
          """    const Similarity place = actor.placement(t);
    actor.joint_matrices(t, matrices_);
    for (auto& m : matrices_) m = Affine3<double>{rotation_matrix(place.rotation), place.translation} * m;
""",
          SKIN_TEST, "N55_lbs_rigid_far", why="float's step at 1000 m, and the weights' sum times 1000 m"),
    plant("quaternion_of_a_matrix_by_the_trace", QUAT, "  if (trace > S(0)) {\n", "  if (trace > S(-2)) {\n",
          "tests/math/test_quat.cpp", "rotations by 180 degrees survive the way through a matrix"),
    plant("nlerp", QUAT, "  if (c > S(0.9999999)) {\n", "  if (c > S(-2)) {\n",
          POSE_TEST, "N60_slerp_vs_lerp", why="the same path at another speed"),
    plant("slerp_the_long_way", QUAT, SHORT, "", POSE_TEST, "N60_slerp_vs_lerp"),
    plant("matrices_mixed", MOTION,
          "out.rotations[j] = slerp(rotations[a * joints + j], rotations[b * joints + j], u);",
          "out.rotations[j] = quat_from_matrix(rotation_matrix(rotations[a * joints + j]) * (1 - u) +\n"
          "                                          rotation_matrix(rotations[b * joints + j]) * u);",
          POSE_TEST, "N60_slerp_vs_lerp"),
    plant("mirrored_joint_taken", MOTION, "!(determinant(m.linear) > kMinBlendDeterminant)",
          "!(abs(determinant(m.linear)) > kMinBlendDeterminant)",
          "tests/avatar/test_motion.cpp", "joint matrices become a clip that gives them back",
          why="Newton's iteration keeps the determinant's sign"),
    plant("cofactors_by_plain_products", "include/gsnav/math/vec.hpp",
          "  return fma(a, b, -cd) + error;\n", "  return (a * b - cd) + error * L(0);\n",
          FACTOR_TEST, "N62_psd_factor"),
    plant("factor_det_ac_minus_b2", "include/gsnav/kernels/projection.hpp",
          "const L det = fma(h, (a0 + c0) + h, det0);",
          "const L det = (a0 + h) * (c0 + h) - b0 * b0;",
          FACTOR_TEST, "N62_psd_factor"),
    plant("factor_area_signed", "include/gsnav/kernels/projection.hpp",
          "const L det0 = dot(area, area);", "const L det0 = dot(area, area) * select(dot(m.row[0], "
          "axes.cofactors.row[0]) < L(S(0)), L(S(-1)), L(S(1)));",
          FACTOR_TEST, "N62_psd_factor", why="a mirrored factor has a covariance too"),
]
