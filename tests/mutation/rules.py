#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the table of docs/reference/rules.md: each rule of the library, the functions that it stands in, and the
seeded faults in them (tests/mutation/mutate.py).

    tests/mutation/rules.py [--check]

Each function of the list needs a fault. --check writes nothing, and compares the page with the table. Exit status: 0,
or 1 with what is wrong.
"""
from __future__ import annotations

import argparse
import sys

import mutate
from sources import Sources

PAGE = mutate.ROOT / "docs/reference/rules.md"
BEGIN, END = "<!-- rules.py writes from here -->\n", "<!-- to here -->\n"

# Heading, and for each rule its name and its functions as faults name them, or "file:function".
RULES = {
    "Projection": {
        "centre of a pixel": ("pixel_center",),
        "camera in the frame of a set": ("make_projection_camera", "position_in"),
        "offset of a mean from the camera": ("origin_offset",),
        "point to pixel": ("PinholePoint",),
        "side of the image": ("ImageSide",),
        "axes of a Gaussian": ("splat_axes", "row_axes"),
        "ellipse and compensation": ("project",),
        "other responses": ("add_perspective", "perspective_exponent"),
        "offset of the reference pixel": ("splat_geometry",),
        "double where float fails": ("needs_double",),
        "near plane": ("beyond_near_plane",),
    },
    "Culling": {
        "bounds of a chunk in view": ("nearest_reach", "reach", "chunk_extent"),
        "rows that a cell may see": ("heavy_rows", "whole_groups", "any_of_part"),
        "rough footprint of a row": ("rough_footprint", "RoughView"),
    },
    "Order": {
        "sort key": ("sort_key", "row_key", "depth_key", "distance_key", "KeyCode"),
        "rank of equal keys": ("ViewedSet::rank_of", "store_ranks"),
    },
    "Tiles": {
        "pixels of a footprint": ("pixel_range",),
        "columns of a strip": ("columns", "FootprintRows", "TileColumns"),
        "tiles behind a mesh": ("MeshCull::hides",),
        "counting and writing of lists": ("for_each_intersection", "EmitSplatTiles", "count_in_tiles",
                                          "scatter_to_tiles", "for_each_before_mesh", "for_each_tile_of_several",
                                          "for_each_tile_of_large", "NearPairs::ask"),
        "list of a tile": ("splats_of", "pairs_of", "begin_of_bin"),
    },
    "Colour": {
        "spherical harmonics": ("c1", "evaluate_sh", "sh_color"),
        "direction of view": ("view_direction", "turned_back"),
        "colour to 8 bits": ("to_byte",),
    },
    "Blending": {
        "exponent": ("splat_exponent", "column_exponent", "whitened_2"),
        "alpha": ("in_footprint", "alpha_in_footprint"),
        "weight and stop": ("blend_drawn", "blend_splat.hpp:open"),
        "median, first hit and sums of depth": ("crosses", "median", "first_hit", "accumulated", "z_ref",
                                                "last_above_half"),
        "depth along a ray": ("make_splat_depth", "ray_depth"),
        "meshes among Gaussians": ("behind", "alpha_before_mesh", "blend_surface", "blend_within"),
        "Habitat-GS's choice of layer": ("HardDepthPixel",),
        "sums to a pixel": ("finished", "pixel_color", "pixel_expected_depth", "pixel_accumulated_depth",
                            "pixel_value", "store_color"),
    },
    "Storage": {
        "row of a file to a Gaussian": ("activate",),
        "packed bands": ("packed_band",),
    },
    "Meshes": {
        "clipping": ("distance",),
        "coverage and depth": ("inverse_z_at", "interpolate_triangle"),
        "fragments": ("insert", "for_each_fragment"),
    },
    "Skinning": {
        "forward kinematics": ("joint_global",),
        "blend of influences": ("blend_influences", "skinning_weight", "scaled_polar_rotation"),
    },
    "Capsules": {
        "sweep": ("sweep_steps", "next", "SweepRules"),
        "distance kept": ("kCompliantGap",),
    },
}


def places(sources, faults):
    """Per function the file that it stands in and its faults: {function: (file, faults)}."""
    found = {}
    for fault in faults:
        for edit in fault.edits:
            place, why = mutate.place_of(sources, edit)
            if place is None:
                raise SystemExit(f"{fault.name}: {why}")
            for name in (edit.function, f"{place[0].name}:{edit.function}"):
                found.setdefault(name, []).append((place[0].relative_to(mutate.ROOT), fault))
    return found


def table(found):
    """The rows as text, and what is wrong with the list of rules."""
    lines, wrong = [], []
    for heading, rules in RULES.items():
        lines += [f"\n## {heading}\n", "| rule | where | faults | noticed by itself on |", "|---|---|---:|---|"]
        for rule, functions in rules.items():
            entries = [(f, file, fault) for f in functions for file, fault in found.get(f, ())]
            wrong += [f"{rule}: no fault stands in {f}" for f in functions if f not in found]
            files = {}
            for f, file, _ in entries:
                files.setdefault(file, {}).setdefault(f.split(":")[-1])
            where = "; ".join(", ".join(f"`{f}`" for f in names) + f" in `{file.name}`"
                              for file, names in files.items())
            on = [b for b in mutate.fault_lists.EVERY_WAY if any(b in fault.on for *_, fault in entries)]
            number = len({fault.name for *_, fault in entries})
            lines.append(f"| {rule} | {where} | {number} | {', '.join(on) or 'the tests together'} |")
    return "\n".join(lines) + "\n\n", wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing, compare with the page")
    args = parser.parse_args()
    faults = mutate.all_faults()
    rows, wrong = table(places(Sources(mutate.ROOT), faults))
    text = PAGE.read_text()
    begin, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    if args.check and text[begin:end] != rows:
        wrong.append(f"{PAGE.relative_to(mutate.ROOT)} is not what the rules say: run tests/mutation/rules.py")
    elif text[begin:end] != rows:
        PAGE.write_text(text[:begin] + rows + text[end:])
    print("\n".join(wrong) or f"{sum(map(len, RULES.values()))} rules, {len(faults)} faults")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
