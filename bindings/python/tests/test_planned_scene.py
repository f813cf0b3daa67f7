# SPDX-License-Identifier: Apache-2.0
"""Random flats: a seed gives one flat, and agents can walk in it."""

import numpy as np
import pytest

import gsnav


def image(scene):
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(16, 24))
    sim = gsnav.Simulator("cpu", scene, config)
    return sim.reset(gsnav.generate_episodes(scene.navmesh, 1, 1)[0])["rgb"].copy()


def test_a_seed_gives_one_flat():
    made = [gsnav.planned_simulator_scene(gsnav.FloorPlanOptions(seed=s, rooms=2), density=0.05) for s in (5, 5, 6)]
    images = [image(scene) for scene in made]
    assert np.array_equal(images[0], images[1]) and not np.array_equal(images[0], images[2])
    assert made[0].avatar_count == 0


def test_people_walk_on_the_floor_of_the_flat():
    scene = gsnav.planned_simulator_scene(gsnav.FloorPlanOptions(seed=5), people=3, seed=2, density=0.05)
    assert scene.avatar_count == 3
    rules = gsnav.EpisodeRules(min_distance=2.0)
    for episode in gsnav.generate_episodes(scene.navmesh, 5, 1, rules):
        path = scene.navmesh.find_path(episode.start_position, episode.goal_position)
        assert path.length == pytest.approx(episode.geodesic_distance) and path.length >= 2


def test_a_flat_of_triangles_looks_like_that_of_gaussians():
    plan, kinds = gsnav.FloorPlanOptions(seed=5, rooms=2), (gsnav.SurfaceKind.gaussians, gsnav.SurfaceKind.mesh)
    scenes = [gsnav.planned_simulator_scene(plan, kind=kind) for kind in kinds]
    assert [(s.asset_count, s.mesh_count) for s in scenes] == [(1, 0), (0, 1)]
    surfaces = [s.navmesh.surface() for s in scenes]
    assert all(np.array_equal(a, b) for a, b in zip(*surfaces))
    # Both in one batch, with the same poses.
    episodes = gsnav.generate_episodes(scenes[0].navmesh, 8, 1)
    config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(64, 64))
    seen = gsnav.BatchSimulator("cpu", scenes, config, 16,
                                lambda e, n: gsnav.BatchEpisode(scene=e % 2, episode=episodes[e // 2])).reset()
    apart = {name: np.abs(image[::2] - image[1::2]) for name, image in seen.images.items()}
    assert np.median(apart["depth"]) < 0.005 and np.mean(apart["depth"] > 0.1) < 0.1
    assert apart["rgb"].mean() < 0.06


def test_wrong_options_are_named():
    with pytest.raises(gsnav.InvalidArgument, match="rooms = 13"):
        gsnav.planned_simulator_scene(gsnav.FloorPlanOptions(rooms=13))
    with pytest.raises(gsnav.InvalidArgument, match="density"):
        gsnav.planned_simulator_scene(density=0)
    with pytest.raises(TypeError, match="no field"):
        gsnav.FloorPlanOptions(doors=3)


def test_episodes_begin_at_random_times_and_apart_from_people():
    task = gsnav.TaskConfig()
    scene = gsnav.planned_simulator_scene(gsnav.FloorPlanOptions(seed=5), people=5, seed=2, density=0.05, task=task)
    episodes = gsnav.generate_episodes(scene.navmesh, 40, 1)
    begun = gsnav.draw_start_times(episodes, scene, task, 3)
    assert all(e.start_time == 0 for e in episodes), "the list that was given has changed"
    times = np.array([e.start_time for e in begun])
    assert len(set(times)) > 35 and times.min() >= 0 and times.max() < 600
    assert np.array_equal(times % task.control_period, np.zeros(40))
    assert [e.id for e in begun] == [e.id for e in episodes]
    among = gsnav.AvatarTracker(scene, task.agent_radius, task.agent_height)
    assert min(among.distance(e.start_position, e.start_time) for e in begun) > 0.6
    assert min(among.distance(e.start_position, 0.0) for e in episodes) < 0.6, "no episode can show a difference"
    again = gsnav.draw_start_times(episodes, scene, task, 3)
    assert [e.start_time for e in again] == list(times)
    with pytest.raises(gsnav.InvalidArgument, match="control_period"):
        gsnav.draw_start_times(episodes, scene, gsnav.TaskConfig(control_period=0), 3)
