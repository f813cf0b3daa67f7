# SPDX-License-Identifier: Apache-2.0
"""Finds a shortest path on the NavMesh of a scene. usage: shortest_path.py [SCENE]"""

import sys

import gsnav


def main(scene_name: str = "default") -> None:
    # [snippet: path]
    scene = gsnav.open_scene(scene_name, gsnav.OpenOptions(navmesh="auto", agent_radius=0.2))
    navmesh = scene.scene.navmesh
    assert navmesh is not None
    rng = gsnav.Rng(1)
    start = navmesh.random_point(rng, island=0)  # on the largest island
    goal = navmesh.random_point(rng, island=0)
    path = navmesh.path_between(start, goal)  # path.points: float64 [points][3], metres
    # [/snippet]
    for x, y, z in path.points:
        print(f"({x:.2f}, {y:.2f}, {z:.2f})")
    print(f"length {path.length:.2f} metres")


if __name__ == "__main__":
    main(*sys.argv[1:])
