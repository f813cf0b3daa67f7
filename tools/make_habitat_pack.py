#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes data for the examples of Habitat-Lab: PointNav episodes in scans, or a stand-in for Habitat's test scenes.

    tools/make_habitat_pack.py FOLDER SCAN...      episodes in one or more scans
    tools/make_habitat_pack.py FOLDER              episodes in three small rooms, which are made too
    ... [--train 10000] [--others 100]             numbers of episodes

Both write FOLDER/data/datasets/pointnav/habitat-test-scenes/v1/{train,val,test}/*.json.gz, which the examples read.
A NavMesh is written beside each scan that has none, for an agent of 0.1 m radius and 1.5 m height. The rooms are
FOLDER/data/scene_datasets/habitat-test-scenes/*.glb and *.navmesh: tests that ask for the files by name then run;
tests that compare with numbers of the real scenes fail. Each file is written aside and then renamed. Needs the
package gsnav.
"""

import argparse
import contextlib
import json
import pathlib
import struct
import sys
from typing import Iterator

try:
    import gsnav
    import numpy as np
except ImportError as e:
    sys.exit(f"make_habitat_pack.py: {e}. Install the package gsnav: docs/guide/python.md")

FLOOR = 0.07  # Height of the floor, metres.
SCENES = ("skokloster-castle", "van-gogh-room", "apartment_1")
SPLITS = ("train", "val", "test")

# Boxes of each scene: x0, y0, z0, x1, y1, z1 in metres, and a colour. The floor comes first.
_WALL, _INNER, _PILLAR = (0.8, 0.75, 0.65), (0.5, 0.6, 0.75), (0.7, 0.3, 0.25)


def boxes(scene: int) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Boxes of a room of about 10 m by 14 m, divided by a wall with two gaps. Scenes differ in size and pillars."""
    x0, x1, z0, z1 = -5.0 - scene, 6.0, -4.5, 10.5 + scene
    high, thin = FLOOR + 2.5, 0.1
    made = [
        ((x0, FLOOR - 0.1, z0, x1, FLOOR, z1), (0.45, 0.4, 0.35)),
        ((x0, FLOOR, z0, x1, high, z0 + thin), _WALL),
        ((x0, FLOOR, z1 - thin, x1, high, z1), _WALL),
        ((x0, FLOOR, z0, x0 + thin, high, z1), _WALL),
        ((x1 - thin, FLOOR, z0, x1, high, z1), _WALL),
    ]
    for a, b in ((x0, -2.5), (-1.0, 3.0), (4.5, x1)):
        made.append(((a, FLOOR, 3.0, b, high, 3.0 + thin), _INNER))
    for i in range(2 + scene):
        x, z = -3.5 + 2.8 * i, (-1.2, 6.0)[i % 2]
        made.append(((x, FLOOR, z, x + 0.15, high, z + 0.15), _PILLAR))
    return made


def box_triangles(box: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a box, float32 [24][3] with those of a face together, and triangles, uint32 [12][3]."""
    low, high = np.array(box[:3]), np.array(box[3:])
    points, faces = [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                p = np.empty(3)
                p[axis] = (low, high)[side][axis]
                p[u], p[v] = (low, high)[a][u], (low, high)[b][v]
                corners.append(p)
            n = len(points)
            points += corners if side else corners[::-1]
            faces += [[n, n + 1, n + 2], [n, n + 2, n + 3]]
    return np.array(points, np.float32), np.array(faces, np.uint32)


def glb(scene: int) -> bytes:
    """A scene as a binary glTF with a material per box."""
    data, views, accessors, materials, primitives = b"", [], [], [], []

    def add(array: np.ndarray, target: int, **accessor: object) -> int:
        nonlocal data
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes, "target": target})
        accessors.append({"bufferView": len(views) - 1, **accessor})
        data += array.tobytes()
        return len(accessors) - 1

    for box, color in boxes(scene):
        points, faces = box_triangles(box)
        low, high = points.min(0).tolist(), points.max(0).tolist()
        at = add(points, 34962, componentType=5126, count=len(points), type="VEC3", min=low, max=high)
        index = add(faces, 34963, componentType=5125, count=faces.size, type="SCALAR")
        materials.append({"pbrMetallicRoughness": {"baseColorFactor": [*color, 1.0], "metallicFactor": 0.0}})
        primitives.append({"attributes": {"POSITION": at}, "indices": index, "material": len(materials) - 1})
    text = json.dumps({
        "asset": {"version": "2.0", "generator": "gsnav make_habitat_pack"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}], "materials": materials,
        "buffers": [{"byteLength": len(data)}], "bufferViews": views, "accessors": accessors,
    }).encode()  # fmt: skip
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def navmesh(scene: int) -> gsnav.NavMesh:
    """The NavMesh of a scene. Boxes stand on the floor as obstacles; their tops are not walkable."""
    points, faces, count = [], [], 0
    for i, (box, _) in enumerate(boxes(scene)):
        p, f = box_triangles(box)
        if i > 0:  # Without tops: the sides alone are obstacles.
            n = np.cross(p[f[:, 1]] - p[f[:, 0]], p[f[:, 2]] - p[f[:, 0]])
            f = f[n[:, 1] <= 0]
        points.append(p.astype(np.float64))
        faces.append(f + np.uint32(count))
        count += len(p)
    return gsnav.NavMesh.build(gsnav.NavMeshSettings(), np.concatenate(points), np.concatenate(faces))


@contextlib.contextmanager
def aside(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """Gives a path beside a file to write to. It becomes the file at the end, and is deleted after an error."""
    part = path.with_name(f".part-{path.name}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def episodes(mesh: gsnav.NavMesh, scene: str, count: int, first: int, seed: int) -> list[gsnav.PointNavEpisode]:
    """Episodes of a scene, numbered from `first`."""
    made = gsnav.generate_episodes(mesh, count, seed)
    for i, episode in enumerate(made):
        episode.id = str(first + i)
        episode.scene_id = scene
    return made


def save(root: pathlib.Path, places: list[tuple[gsnav.NavMesh, str]], train: int, others: int) -> None:
    """Writes the episodes of all splits, divided among the scenes: NavMesh and `scene_id` of each."""
    (root / "data/scene_datasets").mkdir(parents=True, exist_ok=True)  # Habitat-Lab asks for it.
    for k, split in enumerate(SPLITS):
        folder = root / f"data/datasets/pointnav/habitat-test-scenes/v1/{split}"
        folder.mkdir(parents=True, exist_ok=True)
        count, rows = train if split == "train" else others, []
        for i, (mesh, scene) in enumerate(places):
            share = count // len(places) + (i < count % len(places))
            rows += episodes(mesh, scene, share, len(rows), 10 * k + i)
        with aside(folder / f"{split}.json.gz") as part:
            gsnav.io.save_episodes(part, rows)


def make_of_scans(root: pathlib.Path, scans: list[pathlib.Path], train: int, others: int) -> None:
    """Writes episodes in scans below a folder, and a NavMesh beside each scan that has none."""
    places = []
    for scan in scans:
        if not scan.exists():
            raise OSError(f"{scan}: no such file")  # Names of scenes that gsnav makes are none either.
        opened = gsnav.open_scene(scan, gsnav.OpenOptions(navmesh="auto"))
        mesh = opened.scene.navmesh
        beside = scan.with_suffix(".navmesh")
        if not beside.exists():
            with aside(beside) as part:
                gsnav.save_navmesh(mesh, part)
        print(f"{scan}: {mesh.navigable_area():.1f} m2 to stand on, NavMesh {opened.navmesh_source}")
        places.append((mesh, str(scan.resolve())))
    save(root, places, train, others)


def make(root: pathlib.Path, train: int, others: int) -> None:
    """Writes the rooms below a folder, with `train` episodes of one split and `others` of each other one."""
    scenes = root / "data/scene_datasets/habitat-test-scenes"
    scenes.mkdir(parents=True, exist_ok=True)
    meshes = []
    for i, name in enumerate(SCENES):
        meshes.append(navmesh(i))
        with aside(scenes / f"{name}.glb") as part:
            part.write_bytes(glb(i))
        with aside(scenes / f"{name}.navmesh") as part:
            gsnav.save_navmesh(meshes[-1], part)
    names = [f"data/scene_datasets/habitat-test-scenes/{name}.glb" for name in SCENES[:2]]
    save(root, list(zip(meshes, names)), train, others)


def count(text: str) -> int:
    """A number of episodes in an argument."""
    if not text.isdecimal() or len(text) > 9 or int(text) == 0:
        raise argparse.ArgumentTypeError(f"{text}: must be a number from 1 to 999999999")
    return int(text)


def main() -> None:
    """Reads the arguments and writes the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path, help="folder in which data/ is made")
    parser.add_argument("scan", type=pathlib.Path, nargs="*", help="scans (PLY, SPZ, SOG, glTF, ...)")
    parser.add_argument("--train", type=count, default=10000, help="episodes of the split train")
    parser.add_argument("--others", type=count, default=100, help="episodes of the splits val and test")
    arguments = parser.parse_args()
    try:
        if arguments.scan:
            make_of_scans(arguments.folder, arguments.scan, arguments.train, arguments.others)
        else:
            make(arguments.folder, arguments.train, arguments.others)
    except (gsnav.Error, OSError) as e:
        sys.exit(f"make_habitat_pack.py: {e}")
    print(f"{arguments.folder / 'data'}: {len(arguments.scan) or len(SCENES)} scenes, {arguments.train} episodes of "
          f"train, {arguments.others} of val and of test")  # fmt: skip


if __name__ == "__main__":
    main()
