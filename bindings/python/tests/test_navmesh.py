# SPDX-License-Identifier: Apache-2.0
import gc
import math

import numpy as np
import pytest

import gsnav


def test_distance_on_a_flat_square_is_the_straight_one(square):
    rng = np.random.default_rng(1)
    for a, b in rng.uniform(1, 9, (50, 2, 2)):
        start, goal = (a[0], 0.0, a[1]), (b[0], 0.0, b[1])
        path = square.find_path(start, goal)
        straight = math.dist(a, b)
        assert square.geodesic_distance(start, goal) == pytest.approx(straight, abs=1e-5)
        assert path.length == pytest.approx(straight, abs=1e-5)
        assert path.points.shape[1] == 3 and np.allclose(path.points[[0, -1]][:, [0, 2]], [a, b], atol=1e-5)


def test_area_is_that_of_the_square_without_a_margin(square):
    margin = square.bounds().low[0]
    assert 0.09 < margin < 0.21  # the agent's radius of 0.1 m, rounded up to whole cells
    assert square.navigable_area() == pytest.approx((10 - 2 * margin) ** 2, rel=1e-3)
    assert square.island_count() == 1 and square.island_of(gsnav.NO_POLY) is None


def test_points(square):
    assert square.snap_point((5, 1, 5)).position == pytest.approx([5, square.bounds().low[1], 5])
    assert square.snap_point((50, 0, 50)) is None and square.snap_point((math.nan, 0, 0)) is None
    assert square.is_navigable((5, 0, 5)) and not square.is_navigable((-1, 0, 5))
    points = [square.random_point(gsnav.Rng(seed)).position for seed in range(200)]
    assert np.ptp(points, axis=0)[[0, 2]].min() > 8
    assert square.path_status((5, 0, 5), (50, 0, 50)) == gsnav.PathStatus.goal_off_mesh
    assert square.distance_to_closest_obstacle((5, 0, 5), 20.0) == pytest.approx(5 - square.bounds().low[0], abs=0.01)


def test_paths_to_several_goals(square):
    goals = [(9, 0, 9), (4, 0, 5), (50, 0, 50)]
    best = square.find_path_to_any((5, 0, 5), goals)
    assert best.goal == 1 and best.path.length == pytest.approx(1, abs=1e-5)
    assert square.geodesic_distance((5, 0, 5), goals) == pytest.approx(1, abs=1e-5)
    assert math.isinf(square.geodesic_distance((5, 0, 5), (50, 0, 50)))
    with pytest.raises(gsnav.NothingNavigable):
        square.find_path((5, 0, 5), (50, 0, 50))


def test_map_and_surface(square):
    map = square.top_down_map(0.0, 0.5)
    islands = map.islands
    assert islands.shape == (map.rows, map.columns) and islands.dtype == np.int32 and not islands.flags.writeable
    share = (islands == 0).mean()
    del map
    gc.collect()
    assert share > 0.9 and (islands == 0).mean() == share
    vertices, triangles = square.surface()
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(square.navigable_area())


@pytest.mark.parametrize("tile_size, threads", [(0, 1), (64, 1), (64, 3)])
def test_progress_of_a_build(tile_size, threads, tmp_path):
    vertices, triangles = [(0.0, 0, 0), (0, 0, 30), (30, 1, 30), (30, 0, 0)], [(0, 1, 2), (0, 2, 3)]
    settings, shares = gsnav.NavMeshSettings(tile_size=tile_size), []
    quiet = gsnav.NavMesh.build(settings, vertices, triangles)
    told = gsnav.NavMesh.build(settings, vertices, triangles, threads, progress=shares.append)
    gsnav.save_navmesh(quiet, tmp_path / "quiet.navmesh")
    gsnav.save_navmesh(told, tmp_path / "told.navmesh")
    assert (tmp_path / "quiet.navmesh").read_bytes() == (tmp_path / "told.navmesh").read_bytes()
    assert len(shares) > 5 and shares == sorted(shares) and 0 <= shares[0] < 0.1 and shares[-1] <= 1

    def fail(share):
        if share > 0.3:
            raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        gsnav.NavMesh.build(settings, vertices, triangles, threads, fail)
    with pytest.raises(TypeError):
        gsnav.NavMesh.build(settings, vertices, triangles, threads, 3)


def test_files(square, tmp_path):
    gsnav.save_navmesh(square, tmp_path / "a.navmesh")
    again = gsnav.load_navmesh(str(tmp_path / "a.navmesh"))
    assert again.navigable_area() == pytest.approx(square.navigable_area())
    assert again.settings == square.settings
    with pytest.raises(FileNotFoundError, match="none.navmesh"):
        gsnav.load_navmesh(tmp_path / "none.navmesh")
    (tmp_path / "bad.navmesh").write_bytes(b"no mesh")
    with pytest.raises(gsnav.InvalidFile, match="bad.navmesh") as error:
        gsnav.load_navmesh(tmp_path / "bad.navmesh")
    assert error.value.code == gsnav.Errc.invalid_file and isinstance(error.value, ValueError)


@pytest.mark.parametrize("vertices, triangles, error, words", [
    (np.zeros((3, 2)), np.zeros((1, 3), int), ValueError, "vertices have shape"),
    (np.zeros((3, 3), complex), np.zeros((1, 3), int), TypeError, "vertices have dtype"),
    (np.zeros((3, 3)), np.zeros((1, 3)), TypeError, "triangles have dtype"),
    (np.zeros((3, 3)), -np.ones((1, 3), int), ValueError, "indices from -1"),
    (np.zeros((3, 3)), np.full((1, 3), 7), gsnav.InvalidArgument, "7"),
    (np.full((3, 3), np.nan), np.array([[0, 1, 2]]), gsnav.InvalidArgument, "vert"),
])
def test_wrong_arrays(vertices, triangles, error, words):
    with pytest.raises(error, match=words):
        gsnav.NavMesh.build(gsnav.NavMeshSettings(), vertices, triangles)


def test_arrays_of_any_stride_and_precision(square):
    vertices = np.array([[0, 0, 0], [10, 0, 0], [10, 0, 10], [0, 0, 10]], np.float32)
    spread = np.zeros((8, 6), np.float32)
    spread[::2, ::2] = vertices
    spread.flags.writeable = False
    triangles = np.asfortranarray(np.array([[0, 2, 1], [0, 3, 2]], np.int16))
    mesh = gsnav.NavMesh.build(gsnav.NavMeshSettings(), spread[::2, ::2], triangles)
    assert mesh.navigable_area() == square.navigable_area()
