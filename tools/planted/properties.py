# SPDX-License-Identifier: Apache-2.0
"""What every image has to have, whatever is in it."""
from . import plant

BLEND = "include/gsnav/detail/frame/blend.hpp"
PROJECTION = "include/gsnav/detail/frame/projection.hpp"
CHUNK = "include/gsnav/detail/frame/project_chunk.hpp"
TEST = "tests/hard_cases/test_properties.cpp"

PLANTS = [
    plant("depth_with_an_epsilon", PROJECTION,
          "const L inv_z = L(S(1)) / t.z;", "const L inv_z = L(S(1)) / (t.z + L(S(1e-7)));",
          TEST, "property_scale_by_power_of_two", why="INRIA: a length that belongs to no scene"),
    plant("pixel_by_its_corner", BLEND,
          "    px = S(x) + S(0.5);\n    py = S(y) + S(0.5);\n", "    px = S(x);\n    py = S(y);\n",
          TEST, "property_roll_by_90_degrees", "property_horizontal_mirror"),
    plant("limits_for_every_response", PROJECTION,
          "const L uj = ewa ? clamp(u, L(camera.u_min), L(camera.u_max)) : u;",
          "const L uj = clamp(u, L(camera.u_min), L(camera.u_max));",
          TEST, "property_split_screen", why="what is seen would hang on how large the image is"),
    plant("more_opacity_is_less", "include/gsnav/render/render_config.hpp",
          "r.exclusive_stop = c.compat != Compat::none;", "r.exclusive_stop = true;",
          TEST, "property_opacity_monotonicity"),
    plant("closed_pixel_goes_on", BLEND, "transmittance >= L(rules.transmittance_min)", "transmittance >= L(S(0))",
          TEST, "property_occluded_changes_nothing"),
    plant("sets_one_after_the_other", CHUNK, "out.keys[slot] = args.camera.key_code(row.key);",
          "out.keys[slot] = (args.camera.key_code(row.key) >> 1) | (args.first_chunk == 0 ? 0u : 0x80000000u);",
          TEST, "property_union_is_the_merged_list", why="Habitat-GS: bodies in front of or behind a whole scene"),
    plant("depth_in_asset_units", PROJECTION, "d.z = axes.position.z * L(camera.scale);", "d.z = axes.position.z;",
          TEST, "property_placement"),
    plant("reach_in_asset_units", PROJECTION, "* norm(axes.factor.row[2]) * L(camera.scale);",
          "* norm(axes.factor.row[2]);", TEST, "property_placement"),
]
