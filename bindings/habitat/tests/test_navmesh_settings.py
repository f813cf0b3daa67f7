# SPDX-License-Identifier: Apache-2.0
"""Settings of a NavMesh that a simulator builds, on steps, ramps and small floors whose areas are known."""

import math

import habitat_sim
import numpy as np
import pytest
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


def quad(points):
    """Two triangles; the corners are counter-clockwise seen from above."""
    return points, [[0, 1, 2], [0, 2, 3]]


def flat(x0, z0, x1, z1, y):
    return quad([[x0, y, z0], [x0, y, z1], [x1, y, z1], [x1, y, z0]])


def arrays():
    """Vertices and triangles. A floor of 6 m by 6 m has a floor of 3 m by 6 m at one side, 0.4 m higher. At the
    opposite side a ramp of 30 degrees begins, 3 m long on the ground. A floor of 1 m by 1 m is apart from them."""
    rise = 3 * math.tan(math.radians(30))
    parts = [
        flat(0, 0, 6, 6, 0.0),
        flat(6, 0, 9, 6, 0.4),
        quad([[-3, rise, 0], [-3, rise, 6], [0, 0, 6], [0, 0, 0]]),
        flat(20, 0, 21, 1, 0.0),
    ]
    vertices, triangles = [], []
    for corners, faces in parts:
        triangles += [[len(vertices) + i for i in face] for face in faces]
        vertices += corners
    return np.array(vertices, float), np.array(triangles)


@pytest.fixture(scope="module")
def sim(tmp_path_factory):
    vertices, triangles = arrays()
    path = tmp_path_factory.mktemp("scene") / "floors.obj"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in triangles.tolist()]
    path.write_text("\n".join(lines) + "\n")
    # A file beside the scene is read when it is opened, and plays no part when a mesh is built.
    other = gsnav.NavMesh.build(gsnav.NavMeshSettings(), *(np.array(x) for x in flat(0, 0, 2, 2, 0.0)))
    gsnav.save_navmesh(other, path.with_suffix(".navmesh"))
    config = make_cfg({"scene": str(path), "width": 8, "height": 8, "color_sensor": False})
    with habitat_sim.Simulator(config) as made:
        assert made.pathfinder.navigable_area < 4.5
        yield made


def rebuilt(sim, **values):
    settings = habitat_sim.NavMeshSettings()
    settings.cell_height = 0.1
    for name, value in values.items():
        setattr(settings, name, value)
    finder = habitat_sim.PathFinder()
    assert sim.recompute_navmesh(finder, settings)
    assert finder.nav_mesh_settings == settings
    return finder


def test_steps_ramps_and_small_floors(sim):
    low, high, foot, apart = [3, 0, 3], [7.5, 0.4, 3], [1, 0, 3], [20.5, 0, 0.5]
    ramp = [-1.5, 1.5 * math.tan(math.radians(30)), 3]
    finder = rebuilt(sim, agent_max_climb=0.2)
    assert finder.get_island(low) != finder.get_island(high) and finder.get_island(foot) == finder.get_island(ramp)
    finder = rebuilt(sim, agent_max_climb=0.5)
    assert finder.get_island(low) == finder.get_island(high) >= 0
    finder = rebuilt(sim, agent_max_slope=20.0)
    assert finder.is_navigable(low) and not finder.is_navigable(ramp)
    # 16 cells by 16 cells are fewer than 20 times 20, and more than 10 times 10.
    assert not rebuilt(sim).is_navigable(apart) and rebuilt(sim, region_min_size=10.0).is_navigable(apart)
    # An agent that needs more room than there is has no surface anywhere.
    settings = habitat_sim.NavMeshSettings()
    settings.agent_radius = 4.0
    assert not sim.recompute_navmesh(habitat_sim.PathFinder(), settings)


@pytest.mark.parametrize(
    "values",
    [
        {"cell_height": 0.05, "agent_max_climb": 0.45},
        {"agent_max_slope": 60.0, "agent_height": 2.0},
        {"region_min_size": 4.0, "region_merge_size": 40.0},
        {"edge_max_len": 2.0, "edge_max_error": 0.5, "verts_per_poly": 3.0},
        {"detail_sample_dist": 2.0, "detail_sample_max_error": 0.2},
        {"filter_ledge_spans": False, "filter_low_hanging_obstacles": False, "filter_walkable_low_height_spans": False},
        {"include_static_objects": True, "agent_radius": 0.25, "cell_size": 0.08},
    ],
    ids=lambda values: "-".join(values),
)
def test_a_mesh_is_the_one_that_the_library_builds_from_the_triangles(sim, values):
    finder = rebuilt(sim, **values)
    native = gsnav.NavMeshSettings(
        **{"cell_height": 0.1, **values, "verts_per_poly": int(values.get("verts_per_poly", 6))}
    )
    want = gsnav.NavMesh.build(native, *arrays())
    assert np.allclose(np.array(finder.build_navmesh_vertices()), want.surface()[0], atol=1e-5)
    assert finder.build_navmesh_vertex_indices() == want.surface()[1].reshape(-1).tolist()


def test_values_out_of_range_are_named(sim):
    settings = habitat_sim.NavMeshSettings()
    settings.agent_max_slope = -5.0
    with pytest.raises(ValueError, match="agent_max_slope"):
        sim.recompute_navmesh(sim.pathfinder, settings)
    with habitat_sim.Simulator(make_cfg({"scene": "NONE", "width": 8, "height": 8})) as empty:
        assert not empty.recompute_navmesh(empty.pathfinder, habitat_sim.NavMeshSettings())


def opened(path, **values):
    """The PathFinder of a simulator that asks for settings, or for none."""
    config = make_cfg({"scene": str(path), "width": 8, "height": 8, "color_sensor": False})
    if values:
        config.sim_cfg.navmesh_settings = habitat_sim.NavMeshSettings()
        for name, value in values.items():
            setattr(config.sim_cfg.navmesh_settings, name, value)
    with habitat_sim.Simulator(config) as made:
        return made.pathfinder


def test_a_simulator_builds_the_mesh_if_the_file_has_other_settings(sim, caplog):
    path = sim.config.sim_cfg.scene_id
    small = opened(path).navigable_area
    assert small < 4.5  # That of the file.
    # Equal settings, and those that Habitat-Sim does not compare.
    assert opened(path, agent_radius=0.1 + 2e-6).navigable_area == small
    assert opened(path, region_merge_size=9.0, include_static_objects=True).navigable_area == small
    for values in ({"agent_radius": 0.3}, {"agent_max_slope": 20.0}, {"filter_ledge_spans": False}):
        finder, want = opened(path, **values), rebuilt(sim, cell_height=0.2, **values)
        assert finder.nav_mesh_settings == want.nav_mesh_settings
        assert finder.navigable_area == want.navigable_area > 40
    # Nothing can be built for this agent: the file is kept, and a warning says so.
    assert opened(path, agent_radius=5.0).navigable_area == small and "NavMesh of other settings" in caplog.text
    assert opened(path).navigable_area == small
    with pytest.raises(ValueError, match="agent_max_slope"):
        opened(path, agent_max_slope=-5.0)


def test_lower_voxels_among_gaussians_are_no_other_setting(tmp_path):
    scan = tmp_path / "flat.ply"
    gsnav.io.save_scene(scan, gsnav.open_scene("default", gsnav.OpenOptions(navmesh="none")).scene.assets[0].cloud)
    built = gsnav.open_scene(scan, gsnav.OpenOptions(navmesh="build")).scene.navmesh
    part = gsnav.NavMesh.build(built.settings, *(np.array(x) for x in flat(0, 0, 2, 2, 0.0)))
    gsnav.save_navmesh(part, scan.with_suffix(".navmesh"))  # To be told from one that is built.
    assert opened(scan, agent_radius=0.1).navigable_area < 4.5
    assert opened(scan, cell_height=0.03).navigable_area > 20 and opened(scan, agent_radius=0.2).navigable_area > 20
