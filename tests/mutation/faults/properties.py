# SPDX-License-Identifier: Apache-2.0
"""What every image has to have, whatever is in it."""
from . import fault

TEST = "tests/hard_cases/test_properties.cpp"

FAULTS = [
    fault("depth_with_an_epsilon", "PinholePoint",
          "inv_z(L(scalar_of<L>(1)) / point.z)", "inv_z(L(scalar_of<L>(1)) / (point.z + L(scalar_of<L>(1e-7))))",
          TEST, "property_scale_by_power_of_two", why="INRIA: a length that belongs to no scene"),
    fault("pixel_by_its_corner", "pixel_center", "static_cast<S>(pixel) + S(0.5)", "static_cast<S>(pixel)",
          TEST, "property_roll_by_90_degrees", "property_horizontal_mirror"),
    fault("limits_for_every_response", "project",
          "const L uj = ewa ? clamp(u, L(camera.u_min), L(camera.u_max)) : u;",
          "const L uj = clamp(u, L(camera.u_min), L(camera.u_max));",
          TEST, "property_split_screen", why="what is seen would hang on how large the image is"),
    fault("more_opacity_is_less", "follow",
          "r.exclusive_stop = compat != Compat::none;", "r.exclusive_stop = true;",
          TEST, "property_opacity_monotonicity"),
    fault("closed_pixel_goes_on", "open", "transmittance >= L(rules.transmittance_min)", "transmittance >= L(S(0))",
          TEST, "property_occluded_changes_nothing"),
    fault("sets_one_after_the_other", "write_splat", "out.keys[slot] = args.camera.key_code(row.key);",
          "out.keys[slot] = (args.camera.key_code(row.key) >> 1) | (args.first_chunk == 0 ? 0u : 0x80000000u);",
          TEST, "property_union_is_the_merged_list", why="Habitat-GS: bodies in front of or behind a whole scene"),
    fault("depth_in_asset_units", "make_splat_depth", "d.z = axes.position.z * L(camera.scale);",
          "d.z = axes.position.z;",
          TEST, "property_placement"),
    fault("reach_in_asset_units", "make_splat_depth", "* norm(axes.factor.row[2]) * L(camera.scale);",
          "* norm(axes.factor.row[2]);", TEST, "property_placement"),
]
