# SPDX-License-Identifier: Apache-2.0
"""Naive ways of drawing meshes, and of putting them among Gaussians (docs/composition.md)."""
from planted import plant

RASTER = "include/gsnav/detail/mesh/mesh_raster.hpp"
SETUP = "include/gsnav/detail/mesh/mesh_setup.hpp"
CLIP = "include/gsnav/detail/mesh/mesh_clip.hpp"
MERGE = "include/gsnav/detail/frame/composite.hpp"
MESH = "tests/ops/test_mesh.cpp"
CASES = "tests/hard_cases/test_composite.cpp"
PANES = "tests/hard_cases/test_fragments.cpp"
FRAGMENTS = "include/gsnav/detail/mesh/mesh_fragments.hpp"

PLANTS = [
    plant("mesh_edges_of_both", RASTER, "(owns ? 0 : 1)", "0", MESH, "triangles that share edges own each pixel once",
          why="a centre on an edge belongs to both triangles"),
    plant("mesh_edges_of_none", RASTER, "(owns ? 0 : 1)", "1", MESH, "triangles that share edges own each pixel once",
          why="a centre on an edge belongs to neither triangle"),
    plant("mesh_affine_depth", SETUP, "out.inverse_z = plane(per_depth);", "out.inverse_z.value = 1.0 / z_max;", MESH,
          "planes: depth in closed form, from a centimetre to the horizon"),
    plant("mesh_sliver_depth", RASTER, "clamp(plane, t.inverse_z_min, t.inverse_z_max)", "plane", MESH,
          "slivers and needles keep the depth of their corners"),
    plant("mesh_no_near_clip", CLIP, "case 0: return p.z - near_plane;", "case 0: return p.z - 1e-9;", MESH,
          "random triangles, also huge ones and behind the camera: what a ray tracer in long double meets"),
    plant("mesh_ignored", MERGE, "(ray_depth(depth, px, py) > mesh)", "(ray_depth(depth, px, py) > mesh + L(S(1e9)))",
          CASES, "N49_mesh_between_layers", "N50_mesh_straddle_cloud", why="Gaussians behind a mesh are seen"),
    plant("mesh_by_centres", MERGE, "(ray_depth(depth, px, py) > mesh)", "(L(depth.z) > mesh)", CASES,
          "N50_mesh_straddle_cloud", "N51_avatar_touching_wall", why="one depth a splat, wherever the ray meets it"),
    plant("fragment_by_centres", MERGE, "return z > far || z <= near ? S(0) : alpha;",
          "return depth.z > far || depth.z <= near ? S(0) : alpha;", PANES, "N73_pane_cuts_splats", "N74_panes_any",
          why="a pane is before or behind a whole splat"),
    plant("fragments_unsorted", FRAGMENTS, "i > 0 && list[i - 1].depth > f.depth", "false", PANES,
          "N71_panes_between_layers", "N74_panes_any", "N76_many_panes"),
    plant("fragments_behind", FRAGMENTS, "z <= args.behind[pixel] && ", "", PANES, "N71_panes_between_layers"),
    plant("mask_ignored", RASTER, "return t.masked && surface_hole", "return false && surface_hole", PANES,
          "holes that a mask cuts", "N74_panes_any"),
    plant("mesh_leaves_alpha", MERGE, "state.transmittance = select(state.transmittance < L(S(0)), -after, after);", "",
          CASES,
          "N49_mesh_between_layers"),
    plant("mesh_cull_by_centre", "include/gsnav/detail/frame/tiles.hpp", "depths[splat].z - depths[splat].reach > tile_far[tile]",
          "depths[splat].z > tile_far[tile]", CASES, "N53_tile_max_mesh_cull"),
    plant("mesh_chunk_without_reach", "include/gsnav/detail/render/composite_steps.hpp", "* (1 - 1e-6) - reach * (1 + 1e-5);",
          "+ reach;", CASES, "N53_tile_max_mesh_cull of chunks, before they are projected"),
]
