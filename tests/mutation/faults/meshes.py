# SPDX-License-Identifier: Apache-2.0
"""Naive ways of drawing meshes, and of putting them among Gaussians (docs/reference/composition.md)."""
from . import BACKENDS, BY_ALL_TILES, fault

MESH = "tests/ops/test_mesh.cpp"
CASES = "tests/hard_cases/test_composite.cpp"
PANES = "tests/hard_cases/test_fragments.cpp"
HARD_DEPTH = "hard_depth shows Gaussians*"
RAYS = "random triangles, also huge ones and behind the camera: what a ray tracer in long double meets"

FAULTS = [
    fault("mesh_edges_of_both", "of", "(owns ? 0 : 1)", "0", MESH, "triangles that share edges own each pixel once",
          why="a centre on an edge belongs to both triangles"),
    fault("mesh_edges_of_none", "of", "(owns ? 0 : 1)", "1", MESH, "triangles that share edges own each pixel once",
          why="a centre on an edge belongs to neither triangle"),
    fault("mesh_affine_depth", "interpolate_triangle", "out.inverse_z = plane(per_depth);",
          "out.inverse_z.value = 1.0 / z_max;", MESH,
          "planes: depth in closed form, from a centimetre to the horizon"),
    fault("mesh_sliver_depth", "inverse_z_at", "clamp(plane, t.inverse_z_min, t.inverse_z_max)", "plane", MESH,
          "slivers and needles keep the depth of their corners"),
    fault("mesh_no_near_clip", "distance", "k == 0 ? p.z - near_plane :", "k == 0 ? p.z - 1e-9 :", MESH, RAYS),
    fault("mesh_side_without_margin", "ImageSide", "extent - c + margin", "extent - c", MESH, RAYS),
    fault("mesh_pixel_centres_at_integers", "PinholePoint", "x(fma(L(lens.fx), u, L(lens.cx)))",
          "x(fma(L(lens.fx), u, L(lens.cx) + L(scalar_of<L>(0.5))))", MESH, RAYS),
    fault("mesh_ignored", "alpha_before_mesh", "behind(ray_depth(depth, px, py), mesh)",
          "behind(ray_depth(depth, px, py), mesh + L(S(1e9)))",
          CASES, "N50_mesh_straddle_cloud", why="Gaussians behind a mesh are seen",
          on=BY_ALL_TILES),
    fault("mesh_by_centres", "alpha_before_mesh", "behind(ray_depth(depth, px, py), mesh)", "behind(L(depth.z), mesh)",
          CASES, "N50_mesh_straddle_cloud", "N51_avatar_touching_wall",
          why="one depth a splat, wherever the ray meets it", on=BY_ALL_TILES),
    fault("fragment_by_centres", "blend_within", "const S z = ray_depth(depth, px, py);",
          "const S z = depth.z;", PANES, "N73_pane_cuts_splats*",
          why="a pane is before or behind a whole splat", on=BACKENDS),
    fault("fragments_unsorted", "insert", "i > 0 && list[i - 1].depth > f.depth", "false", PANES,
          "N71_panes_between_layers*", "N76_many_panes*", on=BACKENDS),
    fault("fragments_behind", "for_each_fragment", "z <= args.behind[pixel] && ", "", PANES,
          "N71_panes_between_layers*", on=BACKENDS),
    fault("mask_ignored", "mesh_hole", "return t.masked && surface_hole", "return false && surface_hole", PANES,
          "holes that a mask cuts*"),
    fault("mesh_leaves_alpha", "blend_surface",
          "state.transmittance = select(state.transmittance < L(S(0)), -after, after);", "",
          CASES,
          "N49_mesh_between_layers", on=BY_ALL_TILES),
    fault("hard_depth_of_the_farther", "HardDepthPixel", "covered && d > z", "covered && d < z", CASES, HARD_DEPTH,
          why="the mesh shows where it is farther", on=BY_ALL_TILES),
    fault("hard_depth_of_the_faint", "HardDepthPixel", "a > S(kHabitatReturnAlpha)", "a > S(0)", CASES, HARD_DEPTH,
          why="Gaussians too faint for a depth are drawn", on=BY_ALL_TILES),
    fault("hard_depth_alpha_of_the_mesh", "HardDepthPixel", "covered ? S(1) : (lost ? S(0) : a)", "lost ? S(0) : a",
          CASES, HARD_DEPTH, why="a mesh is transparent", on=BY_ALL_TILES),
    fault("mesh_cull_by_centre", "behind", "d.z - d.reach > depth", "d.z > depth", CASES, "N53_tile_max_mesh_cull",
          on=BACKENDS),
    fault("mesh_chunk_without_reach", "nearest_reach", "* (1 - 1e-6) - reach * (1 + 1e-5);",
          "+ reach;", CASES, "N53_tile_max_mesh_cull of chunks, before they are projected", on=("openmp",)),
]
