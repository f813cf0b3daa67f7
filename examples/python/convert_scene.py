# SPDX-License-Identifier: Apache-2.0
"""Converts a scene, gives it levels of detail, and measures both. usage: convert_scene.py [SCENE [OUT]]"""

import sys

import gsnav


def main(scene_name: str = "default", out: str = "scene.spz") -> None:
    # [snippet: convert]
    opened = gsnav.open_scene(scene_name, gsnav.OpenOptions(keep_zero_bands=True))
    asset = opened.scene.assets[0]  # a copy that shares the Gaussians
    assert asset.cloud is not None
    gsnav.io.save_scene(out, asset.cloud)  # .ply, .compressed.ply, .splat, .spz, .sog, .glb
    # [/snippet]
    # [snippet: levels]
    asset.lod = gsnav.build_lod("best", asset.cloud)
    scene = gsnav.SimulatorScene(opened, assets=[asset])
    cameras = gsnav.views_around(opened, 2, 96, 96)
    direct = gsnav.RenderOptions(render=gsnav.RenderConfig(quality=gsnav.Quality.fast()))
    levels = gsnav.RenderOptions(render=direct.render, detail=gsnav.DetailChoice(lod=gsnav.LodChoice(pixels=1.0)))
    for name, options in [("direct", direct), ("levels", levels)]:
        # Judged by a photo: four times the resolution, averaged, in float64.
        print(name, gsnav.eval.error_report("best", scene, cameras, options, photo=4))
    # [/snippet]


if __name__ == "__main__":
    main(*sys.argv[1:])
