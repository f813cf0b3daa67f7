# SPDX-License-Identifier: Apache-2.0
"""PathFinder, paths, steps, maps and the follower on a rectangle and on two islands, against closed forms."""

import math
import struct

import habitat_sim
import numpy as np
import pytest
from habitat_sim.nav import GreedyFollowerCodes
from magnum import Vector3

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


def floor(x0, z0, x1, z1, y, first):
    """A walkable rectangle: four vertices and two triangles."""
    return [[x0, y, z0], [x0, y, z1], [x1, y, z1], [x1, y, z0]], [
        [first, first + 1, first + 2],
        [first, first + 2, first + 3],
    ]


def finder_of(*floors, **settings):
    vertices, triangles = [], []
    for rectangle in floors:
        v, t = floor(*rectangle, len(vertices))
        vertices += v
        triangles += t
    finder = habitat_sim.PathFinder()
    made = gsnav.NavMeshSettings(**settings)
    finder._mesh = gsnav.NavMesh.build(made, np.array(vertices, float), np.array(triangles))
    finder.seed(7)
    return finder


@pytest.fixture(scope="module")
def room():
    """10 m by 6 m at height 0, whose surface ends 0.1 m or a little more before the edge."""
    return finder_of((0, 0, 10, 6, 0.0))


@pytest.fixture(scope="module")
def islands():
    """6 m by 6 m at height 0, and 3 m by 3 m at height 2."""
    return finder_of((0, 0, 6, 6, 0.0), (8, 0, 11, 3, 2.0))


def walls(finder):
    """Corners of the box of the surface."""
    vertices = np.array([list(v) for v in finder.build_navmesh_vertices()])
    return Vector3(*vertices.min(0)), Vector3(*vertices.max(0))


def headers(path):
    """Corners of the box of the tiles, from a .navmesh file of version 2: 4 numbers and 7 words, 18 fields of
    settings, then tiles with a reference and a size. The corners are the floats 18 to 23 of a tile's header."""
    data = path.read_bytes()
    _, version, count = struct.unpack_from("<4sii", data)
    assert version == 2
    at, corners = data.index(b"VAND") - 8, []
    for _ in range(count):
        size = struct.unpack_from("<i", data, at + 4)[0]
        assert data[at + 8 : at + 12] == b"VAND"
        corners.append(struct.unpack_from("<6f", data, at + 8 + 72))
        at += 8 + size
    assert at == len(data)
    corners = np.array(corners, np.float32)
    return corners[:, :3].min(0), corners[:, 3:].max(0)


def test_without_a_mesh():
    finder = habitat_sim.PathFinder()
    assert not finder.is_loaded and finder.nav_mesh_settings is None
    assert not finder.load_nav_mesh("no_such.navmesh") and not finder.save_nav_mesh("/tmp/never.navmesh")
    with pytest.raises(RuntimeError, match="no NavMesh is loaded"):
        finder.get_bounds()


def test_a_saved_mesh_is_the_same(room, tmp_path):
    assert room.save_nav_mesh(str(tmp_path / "a.navmesh"))
    again = habitat_sim.PathFinder()
    assert again.load_nav_mesh(str(tmp_path / "a.navmesh"))
    assert again.nav_mesh_settings == room.nav_mesh_settings and again.navigable_area == pytest.approx(
        room.navigable_area
    )
    assert again.get_bounds() == room.get_bounds()


def test_points_are_vectors_of_python_floats_and_repeat_by_seed(room):
    room.seed(3)
    first = [room.get_random_navigable_point() for _ in range(5)]
    room.seed(3)
    assert first == [room.get_random_navigable_point() for _ in range(5)]
    low, high = room.get_bounds()
    for p in first:
        assert isinstance(p, Vector3) and [type(x) for x in p] == [float] * 3
        assert all(low[k] - 1e-5 <= p[k] <= high[k] + 1e-5 for k in range(3)) and room.is_navigable(p)
        near = room.get_random_navigable_point_near(p, 1.0)
        assert np.linalg.norm(p - near) <= 1.0001
    assert not room.is_navigable([5, 0.8, 3]) and room.is_navigable([5, 0.8, 3], max_y_delta=1)
    assert room.snap_point([5, 3, 3])[0] == 5 and math.isnan(room.snap_point([50, 0, 3])[0])


def test_islands_by_index_and_by_point(islands):
    assert islands.num_islands == 2
    assert (
        islands.get_island([3, 0, 3]) == 0
        and islands.get_island([9.5, 2, 1.5]) == 1
        and islands.get_island([90, 0, 0]) == -1
    )
    assert islands.island_area(0) > islands.island_area(1) > 0
    assert islands.island_area() == pytest.approx(islands.island_area(0) + islands.island_area(1), rel=1e-5)
    assert (
        islands.island_radius(1) == islands.island_radius([9.5, 2, 1.5]) == pytest.approx(math.sqrt(2) * 1.4, abs=0.1)
    )
    for island, height in ((0, 0), (1, 2)):
        p = islands.get_random_navigable_point(island_index=island)
        assert p.y == pytest.approx(height, abs=0.05) and islands.get_island(p) == island
        assert islands.snap_point(p, island_index=1 - island) != p
        v, i = islands.build_navmesh_vertices(island), islands.build_navmesh_vertex_indices(island)
        assert max(i) < len(v) and len(i) % 3 == 0 and all(abs(x.y - height) < 0.1 for x in v)
    assert math.isnan(islands.get_random_navigable_point(island_index=5).x)


def test_a_step_slides_or_stops_at_a_wall(room):
    high = walls(room)[1]
    slid = room.try_step([5, 0, 5], np.array([6, 0, 7.5]))
    cut = room.try_step_no_sliding(Vector3(5, 0, 5), [6, 0, 7.5])
    assert (
        isinstance(slid, Vector3) and slid.x == pytest.approx(6, abs=1e-4) and slid.z == pytest.approx(high.z, abs=1e-4)
    )
    t = (high.z - 5) / 2.5
    assert cut.x == pytest.approx(5 + t, abs=1e-4) and cut.z == pytest.approx(high.z, abs=1e-4)
    assert room.try_step([5, 0, 3], [5.25, 0, 3]) == [5.25, slid.y, 3]
    assert room.try_step([50, 0, 3], [51, 0, 3]) == [50, 0, 3]


def test_a_step_to_nowhere_or_to_another_island_stays(room, islands):
    """Ends snap within 2 m on the ground and 4 m in height."""
    for step in (room.try_step, room.try_step_no_sliding):
        assert step([5, 0, 3], [11.8, 0, 3]).x == pytest.approx(walls(room)[1].x, abs=1e-4)
        for end in ([11.9, 0, 3], [5, 4.5, 3], [5, 0, 3e9], [5, 0, math.nan]):
            assert step([5, 0.25, 3], end) == [5, 0.25, 3]
    edge = max(v.x for v in islands.build_navmesh_vertices(0))
    for step in (islands.try_step, islands.try_step_no_sliding):
        assert step([5, 0, 1], [6.9, 0, 1]).x == pytest.approx(edge, abs=1e-4)
        assert step([5, 0, 1], [9, 2, 1]) == [5, 0, 1]
        assert step([9, 2, 1], [9.5, 2, 1]) == [9.5, step([9, 2, 1], [9, 2, 1]).y, 1]


def test_radii_out_of_range_are_errors_and_an_infinite_one_is_none(room, islands):
    for call in (room.distance_to_closest_obstacle, room.closest_obstacle_surface_point):
        for radius in (-1, -1e-9, math.nan):
            with pytest.raises(ValueError, match=f"{call.__name__}: max_search_radius = {radius}: must be 0 or more"):
                call([5, 0, 3], radius)
    assert room.distance_to_closest_obstacle([5, 0, 3], 0) == 0
    assert room.distance_to_closest_obstacle([5, 0, 3], math.inf) == pytest.approx(3 - walls(room)[0].z, abs=1e-4)
    for radius in (-1, math.nan):
        with pytest.raises(ValueError, match=f"get_random_navigable_point_near: radius = {radius}: must be 0 or more"):
            room.get_random_navigable_point_near([5, 0, 3], radius)
    points = [islands.get_random_navigable_point_near([90, 0, 0], math.inf) for _ in range(200)]
    found = [islands.get_island(p) for p in points]
    share = islands.island_area(1) / islands.island_area()
    assert set(found) == {0, 1} and abs(sum(found) / 200 - share) < 4 * math.sqrt(share * (1 - share) / 200)
    near = islands.get_random_navigable_point_near([90, 0, 0], math.inf, island_index=1)
    assert near.y == pytest.approx(2, abs=0.05)
    assert math.isnan(islands.get_random_navigable_point_near([90, 0, math.nan], math.inf).x)


def test_walls(room):
    low = walls(room)[0]
    assert room.distance_to_closest_obstacle([1.0, 0, 3]) == pytest.approx(1 - low.x, abs=1e-4)
    assert room.distance_to_closest_obstacle([5, 0, 3], max_search_radius=0.5) == 0.5
    hit = room.closest_obstacle_surface_point([1.0, 0, 3])
    assert isinstance(hit, habitat_sim.HitRecord) and hit.hit_normal == [1, 0, 0]
    assert hit.hit_pos[0] == pytest.approx(low.x, abs=1e-4) and hit.hit_dist == pytest.approx(1 - low.x, abs=1e-4)


def test_paths(room, islands):
    path = habitat_sim.ShortestPath()
    path.requested_start, path.requested_end = [1, 0, 1], np.array([4, 0, 5], np.float32)
    assert room.find_path(path) and path.geodesic_distance == pytest.approx(5)
    assert all(isinstance(p, Vector3) for p in path.points) and np.allclose(path.points[-1], [4, path.points[0].y, 5])
    path.requested_end = [400, 0, 0]
    assert not room.find_path(path) and path.geodesic_distance == math.inf and path.points == []
    goals = habitat_sim.MultiGoalShortestPath()
    goals.requested_start, goals.requested_ends = [1, 0, 1], [[9.5, 2, 1.5], [1, 0, 4], [2, 0, 1]]
    for start, distance, index in (([1, 0, 1], 1, 2), ([1, 0, 3], 1, 1), ([9, 2, 1.5], 0.5, 0)):
        goals.requested_start = start
        assert islands.find_path(goals) and goals.geodesic_distance == pytest.approx(distance, abs=1e-5)
        assert goals.closest_end_point_index == index
    goals.requested_ends = np.array([[400.0, 0, 0]])
    assert not islands.find_path(goals) and goals.closest_end_point_index == -1 and goals.geodesic_distance == math.inf


def test_a_map_has_the_shape_of_habitats(room):
    low, high = room.get_bounds()
    view = room.get_topdown_view(0.1, 0.0)
    assert view.dtype == bool and view.shape == (int((high.z - low.z) / 0.1), int((high.x - low.x) / 0.1))
    # Cells are looked up at their corners, and the surface within a centimetre.
    z, x = (low[k] + 0.1 * np.arange(n) for k, n in ((2, view.shape[0]), (0, view.shape[1])))
    first, last = walls(room)

    def within(margin):
        inside = [(v >= first[k] - margin) & (v <= last[k] + margin) for k, v in ((2, z), (0, x))]
        return np.outer(*inside)

    assert view[within(0)].all() and not view[~within(0.011)].any() and not view.all()
    assert not room.get_topdown_view(0.1, 1.0).any()
    assert np.array_equal(room.get_topdown_view(0.1, 1.0, eps=1.2), view)


@pytest.mark.parametrize("tile_size", [0, 64])
def test_bounds_are_those_of_the_tiles_and_maps_hold_all_navigable_points(tmp_path, tile_size):
    finder = finder_of((1000, -3, 1007, 4, 0.5), (1008, 0, 1011, 3, 2.0), tile_size=tile_size)
    assert finder.save_nav_mesh(str(tmp_path / "a.navmesh"))
    for _ in range(2):  # As it was built, and as it is read.
        bounds = finder.get_bounds()
        for had, want in zip(bounds, headers(tmp_path / "a.navmesh")):
            assert np.array_equal(np.array(had, np.float32), want)
        shape = finder.get_topdown_view(0.1, 0.5).shape
        corners = finder.build_navmesh_vertices()
        for p in [*corners, *(finder.get_random_navigable_point() for _ in range(200))]:
            assert all(bounds[0][k] <= p[k] <= bounds[1][k] for k in (0, 2))
            # The cell as Habitat-Lab's maps.to_grid has it: the box is divided by the cells.
            row, column = (int((p[k] - bounds[0][k]) / ((bounds[1][k] - bounds[0][k]) / n))
                           for k, n in ((2, shape[0]), (0, shape[1])))  # fmt: skip
            assert row < shape[0] and column < shape[1]
        assert finder.load_nav_mesh(str(tmp_path / "a.navmesh"))


def test_settings(tmp_path):
    settings, other = habitat_sim.NavMeshSettings(), habitat_sim.NavMeshSettings()
    assert settings == other
    settings.agent_radius, settings.include_static_objects = 0.3, True
    assert settings != other
    settings.write_to_json(str(tmp_path / "s.json"))
    other.read_from_json(str(tmp_path / "s.json"))
    assert settings == other
    with pytest.raises(AttributeError, match="agent_width"):
        settings.agent_width = 1
    (tmp_path / "bad.json").write_text('{"agent_width": 1}')
    with pytest.raises(ValueError, match="bad.json.*agent_width"):
        other.read_from_json(str(tmp_path / "bad.json"))


def test_the_follower_reaches_its_goal_and_uses_the_keys(room):
    agent = habitat_sim.Agent(habitat_sim.SceneGraph().get_root_node().create_child())
    agent.controls.move_filter_fn = room.try_step
    state = agent.state
    state.position = [2, 0, 2]
    agent.set_state(state)
    follower = habitat_sim.GreedyGeodesicFollower(room, agent)
    assert (
        follower.goal_radius == pytest.approx(0.1875)
        and follower.action_mapping[GreedyFollowerCodes.LEFT] == "turn_left"
    )
    keys = follower.find_path([8, 0, 5])
    assert keys[-1] is None and set(keys) <= {None, "move_forward", "turn_left", "turn_right"}
    for key in keys[:-1]:
        assert follower.next_action_along([8, 0, 5]) == key
        agent.act(key)
    assert np.linalg.norm(agent.state.position[[0, 2]] - [8, 5]) < 0.1875
    with pytest.raises(habitat_sim.errors.GreedyFollowerError):
        follower.next_action_along([80, 0, 5])


def test_the_follower_of_an_agent_that_does_not_slide_is_not_caught_at_a_wall(stage):
    finder = habitat_sim.PathFinder()
    assert finder.load_nav_mesh(stage.replace(".glb", ".navmesh"))
    agent = habitat_sim.Agent(habitat_sim.SceneGraph().get_root_node().create_child())
    agent.controls.move_filter_fn = finder.try_step_no_sliding
    for turn in ("turn_left", "turn_right"):
        agent.agent_config.action_space[turn].actuation.amount = 30.0
    agent.state = habitat_sim.AgentState([-1.05, 0.07, 2.9])  # Beside the end of an inner wall.
    goal = [-1.26, 0.07, 7.9]
    keys = habitat_sim.GreedyGeodesicFollower(finder, agent).find_path(goal)
    for key in keys[:-1]:
        agent.act(key)
    assert len(keys) < 60 and np.linalg.norm(agent.state.position - goal) < 0.2
