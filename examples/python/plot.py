# SPDX-License-Identifier: Apache-2.0
"""Draws a picture, its depth and a map with a path. usage: plot.py [SCENE]; writes plot.png, needs matplotlib"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from pointnav_files import aside  # noqa: E402

import gsnav  # noqa: E402


def main(scene_name: str = "default") -> None:
    scene = gsnav.open_scene(scene_name, gsnav.OpenOptions(navmesh="auto"))
    frames = gsnav.Renderer("best", scene).render(gsnav.framing_camera(scene, 320, 240))
    navmesh = scene.scene.navmesh
    assert navmesh is not None and frames.rgb is not None and frames.median_depth is not None
    episode = gsnav.generate_episode(navmesh, gsnav.Rng(1))
    points = navmesh.find_path(episode.start_position, episode.goal_position).points
    floor = navmesh.top_down_map(points[0][1], 0.05)
    figure, (picture, depth, plan) = plt.subplots(1, 3, figsize=(12, 3.2), layout="constrained")
    picture.imshow(frames.rgb.clip(0, 1))
    figure.colorbar(depth.imshow(frames.median_depth, cmap="viridis_r"), ax=depth, label="depth, metres")
    right, below = floor.low[0] + 0.05 * floor.columns, floor.low[2] + 0.05 * floor.rows
    plan.imshow(floor.islands < 0, cmap="gray_r", extent=(floor.low[0], right, below, floor.low[2]))
    plan.plot(points[:, 0], points[:, 2], "r-")
    plan.set(xlabel="x, metres", ylabel="z, metres")
    with aside(pathlib.Path("plot.png")) as part:
        figure.savefig(part)


if __name__ == "__main__":
    main(*sys.argv[1:])
