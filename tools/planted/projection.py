# SPDX-License-Identifier: Apache-2.0
"""Projection: determinants, the exponent, filters, responses."""
from . import Edit, Plant, plant

PROJECTION = "include/gsnav/detail/frame/projection.hpp"
CAMERA = "include/gsnav/detail/frame/projection_camera.hpp"
CHUNK = "include/gsnav/detail/frame/project_chunk.hpp"
ROW = "include/gsnav/detail/frame/project_row.hpp"
WRITE_SPLATS = "include/gsnav/detail/lanes/write_splats.hpp"
BLEND = "include/gsnav/detail/frame/blend.hpp"
DETERMINANT = "tests/hard_cases/test_determinant.cpp"
EXPONENT = "tests/hard_cases/test_exponent.cpp"
FILTER = "tests/hard_cases/test_filter.cpp"
RESPONSE = "tests/hard_cases/test_response.cpp"
FOOTPRINT = "tests/hard_cases/test_footprint.cpp"

PLANTS = [
    plant("det_ac_minus_b2", PROJECTION,
          "const L det = fma(h, (a0 + c0) + h, det0);",
          "const L det = (a0 + h) * (c0 + h) - b0 * b0;",
          DETERMINANT, "N03_det_needle_1e2", "N04_det_needle_1e4",
          why="cancels for needles: INRIA, gsplat"),
    plant("det0_ac_minus_b2", PROJECTION,
          "const L det0 = dot(area, area);",
          "const L det0 = max(a0 * c0 - b0 * b0, L(S(0)));",
          DETERMINANT, "N05_comp_factor_needle"),
    plant("conic_exponent", BLEND,
          "  return column_exponent(column_terms(g, px), L(g.ref_y), L(g.b), py);\n",
          """  const L ca = L(g.a) * L(g.a) + L(g.k) * L(g.k), cb = L(g.k) * L(g.b), cc = L(g.b) * L(g.b);
  const L ox = L(g.w1) / L(g.a), oy = (L(g.w2) - L(g.k) * ox) / L(g.b);
  const L cx = (px - L(g.ref_x)) + ox, cy = (py - L(g.ref_y)) + oy;
  return L(g.log2_opacity) - (ca * cx * cx + L(S(2)) * cb * cx * cy + cc * cy * cy);
""",
          EXPONENT, "N07_alpha_long_needle", "N08_power_sign",
          why="positive powers and holes in long needles"),
    plant("exponent_from_the_corner", BLEND, "const L w2 = fma(py - ref_y, b, terms.w2);",
          "const L w2 = fma(py, b, fma(-ref_y, b, terms.w2));",
          EXPONENT, "N07_alpha_long_needle", why="offsets from the image's corner cancel"),
    plant("response_ignored", BLEND, "if (along_rays) return perspective_exponent", "if (false) return perspective_exponent",
          RESPONSE, "N02_exact_ray_grid", why="the ellipse of the linearised response"),
    plant("needles_in_float", ROW,
          "  return (fma(abs(p.k), length_x, p.b * length_y) > L(S(512))) ||\n"
          "         (fma(abs(p.k), abs(ref.dx), p.b * abs(ref.dy)) > L(S(16)));",
          "  return length_x + length_y + ref.dx + ref.dy < L(S(-1e30));",
          EXPONENT, "N07_alpha_long_needle", "N09_huge_needle_tilelocal"),
    plant("offset_of_the_reference_unturned", ROW, "fma(p.k, ref.dx, p.b * ref.dy), p.log2_opacity};",
          "p.b * ref.dy, p.log2_opacity};",
          RESPONSE, "N01_ewa_offaxis_grid", "N02_exact_ray_grid", why="w2 has a part along x"),
    plant("mean_in_float", ROW,
          "  return make_splat<Plain>(camera, depth, seen, mean_x, mean_y, out);",
          "  return make_splat<Plain>(camera, depth, seen, seen.splat.mean_x, seen.splat.mean_y, out);",
          RESPONSE, "N01_ewa_offaxis_grid", "N02_exact_ray_grid"),
    plant("mean_in_float_in_lanes", WRITE_SPLATS,
          "reference_of<F>(camera.width, camera.height, mean_x, mean_y)",
          "reference_of<F>(camera.width, camera.height, p.mean_x, p.mean_y)",
          RESPONSE, "N01_ewa_offaxis_grid"),
    plant("needles_in_float_in_lanes", WRITE_SPLATS,
          "const std::uint32_t alone = lane_bits(gsnav::detail::needs_double(camera, p)) & bits;",
          "const std::uint32_t alone = 0;",
          EXPONENT, "N07_alpha_long_needle", "N09_huge_needle_tilelocal"),
    plant("compensation_squared", PROJECTION,
          "max(sqrt(det_base / det), L(camera.min_compensation))",
          "max(det0 / det, L(camera.min_compensation))",
          FILTER, "N12_classic_vs_mip_flag", "N13_comp_subpixel"),
    plant("compensation_floor", PROJECTION,
          "max(sqrt(det_base / det), L(camera.min_compensation))",
          "max(sqrt(det0 / det), L(S(0.005)))",
          FILTER, "N13_comp_subpixel", why="gsplat's floor is a bias"),
    plant("filter_flag_ignored", CAMERA,
          "p.mip = set.filter == Filter::mip || habitat;",
          "p.mip = habitat;",
          FILTER, "N12_classic_vs_mip_flag", "N14_h_0p1_asset"),
    plant("dilation_fixed", CAMERA,
          "p.eps2d = static_cast<S>(set.eps2d);",
          "p.eps2d = static_cast<S>(0.3f);",
          FILTER, "N14_h_0p1_asset", "N15_subpixel_drift"),
    plant("no_dilation", PROJECTION,
          "  const L h(camera.eps2d);\n  const L det =",
          "  const L h(camera.eps2d * S(0.01));\n  const L det =",
          FILTER, "N13_comp_subpixel", "N15_subpixel_drift", "N20_tiny_scales"),
    plant("jacobian_unlimited", PROJECTION,
          "const L uj = ewa ? clamp(u, L(camera.u_min), L(camera.u_max)) : u;",
          "const L uj = u;",
          FOOTPRINT, "N19_offscreen_rod_fan"),
    plant("jacobian_limits_centred", CAMERA,
          "p.u_max = static_cast<S>((camera.width - camera.cx) / camera.fx + tx);",
          "p.u_max = static_cast<S>(camera.width / (2 * camera.fx) + tx);",
          FOOTPRINT, "N19_offscreen_rod_fan",
          why="INRIA forgets the principal point"),
    plant("ray_without_bend", PROJECTION,
          "out.bend = L(S(2 * kLn2)) * (det / ((z * z) * d0));",
          "out.bend = L(S(0)) * det;",
          RESPONSE, "N02_exact_ray_grid"),
    plant("ray_without_dilation", PROJECTION,
          "const L ex = h * (z / L(camera.fx)) * (z / L(camera.fx));",
          "const L ex = L(S(0)) * h;",
          RESPONSE, "N02_exact_ray_grid"),
    plant("tangent_is_ewa", PROJECTION,
          "    slope_u = u * inv;\n",
          "    slope_u = L(S(0)) * inv;\n",
          RESPONSE, "N02_exact_ray_grid"),
    plant("ray_drawn_behind", BLEND,
          "return select(f > L(S(0)), exponent, L(S(-1e30)));", "return exponent;",
          FOOTPRINT, "N11_tile_cover_conservative"),
    Plant("near_inclusive",
          (Edit(PROJECTION, "(key_z > F(camera.near_plane)) &&", "(key_z >= F(camera.near_plane)) &&"),
           Edit(CHUNK, "if (!(key.z > args.camera.near_plane)) return false;",
                "if (!(key.z >= args.camera.near_plane)) return false;")),
          "tests/hard_cases/test_near.cpp", ("N16_near_plane_cross",)),
    plant("near_sigma_ignored", PROJECTION,
          "if (camera.near_sigma > S(0)) {", "if (camera.near_sigma > S(1e9)) {",
          "tests/hard_cases/test_near.cpp", "N17_camera_inside_splat"),
    Plant("behind_kept",
          (Edit(PROJECTION, "(key_z > F(camera.near_plane)) &&", "(abs(key_z) > F(camera.near_plane)) &&"),
           Edit(CHUNK, "if (!(key.z > args.camera.near_plane)) return false;",
                "if (!(abs(key.z) > args.camera.near_plane)) return false;")),
          "tests/hard_cases/test_order.cpp", ("N24_neg_zero_depth",)),
]
