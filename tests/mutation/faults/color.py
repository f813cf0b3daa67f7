# SPDX-License-Identifier: Apache-2.0
"""Spherical harmonics and the direction they are seen from."""
from . import BY_TILES, EVERY, fault

TEST = "tests/hard_cases/test_sh.cpp"
FILTER_TEST = "tests/hard_cases/test_filter.cpp"

CLAMPED = "return {max(sum.x + half, zero), max(sum.y + half, zero), max(sum.z + half, zero)};"

FAULTS = [
    fault("sh_constant_of_five_digits", "c1", "static_cast<S>(0.4886025119029199)", "static_cast<S>(0.48860)",
          TEST, "N38_sh_constants"),
    fault("sh_band_1_as_xyz", "evaluate_sh",
          "  sum = fma(L(-c1) * y, coefficient(1), sum);\n"
          "  sum = fma(L(c1) * z, coefficient(2), sum);\n"
          "  sum = fma(L(-c1) * x, coefficient(3), sum);\n",
          "  sum = fma(L(-c1) * x, coefficient(1), sum);\n"
          "  sum = fma(L(-c1) * y, coefficient(2), sum);\n"
          "  sum = fma(L(c1) * z, coefficient(3), sum);\n",
          TEST, "N40_sh_negative", why="the order of files is y, z, x", on=EVERY),
    fault("sh_without_condon_shortley", "sum", "sum = fma(L(-c3a) * x * fma(L(S(-3)), yy, xx), coefficient(15), sum);",
          "sum = fma(L(c3a) * x * fma(L(S(-3)), yy, xx), coefficient(15), sum);",
          TEST, "N61_sh_rotation_equiv", on=BY_TILES),
    fault("sh_not_clamped", "sh_color", CLAMPED, "return {sum.x + half, sum.y + half, sum.z + half};",
          TEST, "N40_sh_negative", on=EVERY),
    fault("sh_clamped_at_1", "sh_color", CLAMPED,
          "const L one{S(1)};\n  return {clamp(sum.x + half, zero, one), clamp(sum.y + half, zero, one),\n"
          "          clamp(sum.z + half, zero, one)};",
          TEST, "N40_sh_negative", why="what is brighter than 1 is blended before it is clipped", on=EVERY),
    fault("sh_clamped_before_the_offset", "sh_color", CLAMPED,
          "return {max(sum.x, zero) + half, max(sum.y, zero) + half, max(sum.z, zero) + half};",
          TEST, "N40_sh_negative", on=EVERY),
    fault("sh_direction_zero_divided", "view_direction",
          "const auto defined = n > L(S(1e-12));", "const auto defined = n >= L(S(0));",
          TEST, "N39_sh_dir_zero"),
    fault("sh_direction_not_unit", "view_direction",
          "const Vec3<L> unit = delta * (L(S(1)) / n);", "const Vec3<L> unit = delta;",
          FILTER_TEST, "N12_classic_vs_mip_flag", on=EVERY),
    fault("sh_turned_forwards", "turned_back", "rotate(conjugate(rotation), direction)", "rotate(rotation, direction)",
          TEST, "N61_sh_rotation_equiv", why="the direction is turned back, not on", on=BY_TILES),
    fault("sh_not_turned", "gaussian_color", "if (!rows.rotations.empty()) {", "if (degree > 9) {",
          TEST, "N61_sh_rotation_equiv", why="lights stay with the world when a body turns",
          on=("serial", "cuda float", "cuda tiles")),
]
