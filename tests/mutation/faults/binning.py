# SPDX-License-Identifier: Apache-2.0
"""Lists of tiles: which splats are in them, where and in which order. Each backend has a way of its own."""
from . import BACKENDS, fault

STACK = "tests/hard_cases/test_stack.cpp"
MESH = "tests/hard_cases/test_composite.cpp"
KEYS = "tests/hard_cases/test_keys.cpp"
FOOTPRINT = "tests/hard_cases/test_footprint.cpp"
N11_ALPHA = "N11_tile_cover_conservative in images: few needles*"
STRADDLE, CULL = "N50_mesh_straddle_cloud", "N53_tile_max_mesh_cull"
IN_BATCHES = ("cuda tiles", "cuda many")

FAULTS = [
    fault("splat_of_the_place", "for_each_intersection", "const std::uint32_t splat = args.order[i];",
          "const std::uint32_t splat = static_cast<std::uint32_t>(i);",
          STACK, "N42_saturation_stop", on=("serial",), why="a place in the order is no slot"),
    fault("hidden_by_the_place", "for_each_intersection", "cull.hides(tile, splat)",
          "cull.hides(tile, static_cast<std::uint32_t>(i))",
          MESH, STRADDLE, on=("serial",)),
    fault("pairs_in_the_place_of_the_slot", "EmitSplatTiles", "offsets[i]", "offsets[splat]",
          STACK, "N42_saturation_stop", on=("cuda float",)),
    fault("tile_not_covered_counted", "count_in_tiles", "counts[tile] += covered;", "counts[tile] += 1;",
          KEYS, "N26_pair_count_zero", on=("openmp",)),
    fault("tile_not_covered_written", "scatter_to_tiles", "*(covered != 0 ? out + at : &nowhere) = item;",
          "out[at] = item;",
          FOOTPRINT, N11_ALPHA, on=("openmp",), why="it is the first of another tile's list"),
    fault("tile_not_covered_before_a_mesh", "for_each_before_mesh", "covered != 0 && !cull.hides(tile, splat)",
          "!cull.hides(tile, splat)",
          MESH, STRADDLE, on=("openmp",)),
    fault("last_tile_of_a_window_lost", "for_each_tile_of_several", "((2u << (last - first)) - 1u)",
          "((1u << (last - first)) - 1u)",
          FOOTPRINT, N11_ALPHA, on=IN_BATCHES),
    fault("last_tile_of_a_large_row_lost", "for_each_tile_of_large", "last - first + 1", "last - first",
          FOOTPRINT, N11_ALPHA, on=("cuda tiles",), why="few tiles of 16 pixels are not large"),
    fault("tile_to_the_right_lost", "NearPairs::ask", "tiles.x1 != tiles.x0", "tiles.x1 > tiles.x0 + 1",
          FOOTPRINT, N11_ALPHA, on=("cuda many",)),
    fault("tile_hidden_by_the_centre", "MeshCull::hides", "behind(depths[splat], tile_far[tile])",
          "depths[splat].z > tile_far[tile]",
          MESH, CULL, on=BACKENDS, why="what reaches through the mesh is seen"),
    fault("tile_hidden_by_its_neighbour", "MeshCull::hides", "tile_far[tile]", "tile_far[tile > 0 ? tile - 1 : 0]",
          MESH, CULL, on=BACKENDS),
]
