# SPDX-License-Identifier: Apache-2.0
"""Numbers that no call can serve: an error at once that names field, value and range."""

import itertools
import math
import resource
import time

import numpy as np
import pytest

import gsnav

NAN = math.nan


def camera(hfov):
    return gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 8, 8, hfov)


def batch(scene, environments):
    config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(8, 8))
    return gsnav.BatchSimulator("serial", [scene], config, environments, lambda e, k: None)


def vector(scene):
    return gsnav.VectorEnv(2, scene, config=gsnav.SimulatorConfig(sensors=[]), device="serial")


@pytest.mark.parametrize("call, words", [
    (lambda s: gsnav.generate_episodes(s.navmesh, 2**62, 1),
     "generate_episodes: count = 4611686018427387904: must be in [0, 10000000]"),
    (lambda s: gsnav.default_simulator_scene(people=10**9),
     "default_simulator_scene: people = 1000000000: must be in [0, 1000]"),
    (lambda s: gsnav.planned_simulator_scene(gsnav.FloorPlanOptions(), people=1001),
     "planned_simulator_scene: people = 1001: must be in [0, 1000]"),
    (lambda s: gsnav.open_scene("default", gsnav.OpenOptions(people=10**9)),
     "OpenOptions.people = 1000000000: must be in [0, 1000]"),
    (lambda s: batch(s, 2**40), "environments = 1099511627776: must be in [1, 65536]"),
    (lambda s: batch(s, 0), "environments = 0: must be in [1, 65536]"),
    (lambda s: gsnav.Renderer("serial", s).render([]), "Renderer.render: cameras = []: there is no camera"),
    (lambda s: camera(180), "Camera.look_at: hfov = 180.000000: must be in (0, 180) degrees"),
    (lambda s: camera(200), "hfov = 200.000000"),
    (lambda s: camera(0), "hfov = 0.000000"),
    (lambda s: camera(90).set_hfov(8, 8, NAN), "Camera.set_hfov: hfov = nan"),
    (lambda s: gsnav.framing_camera(gsnav.open_scene("default", gsnav.OpenOptions(density=0.05)), 8, 8, 180),
     "hfov = 180.000000: must be in (0, 180) degrees"),
    (lambda s: gsnav.Renderer("serial", s).render(gsnav.Camera(fx=1e-15)), "Camera.fx = 0.000000: must exceed"),
    (lambda s: s.navmesh.random_point(gsnav.Rng(1), 10**9), "random_point: island = 1000000000: must be in [0, "),
    (lambda s: s.navmesh.random_point_near(gsnav.Rng(1), (5, 0, 4), 1.0, 10**9), "random_point_near: island = 10"),
    (lambda s: s.navmesh.island_area(10**9), "NavMesh.island_area: island = 1000000000: must be in [0, "),
    (lambda s: s.navmesh.island_radius(10**9), "NavMesh.island_radius: island = 1000000000"),
    (lambda s: s.navmesh.surface(10**9), "NavMesh.surface: island = 1000000000"),
    (lambda s: gsnav.AvatarTracker(s).move((NAN, 0, 0), (1, 0, 1), 0.0, 1.0), "AvatarTracker.move: start = (nan, "),
    (lambda s: gsnav.AvatarTracker(s).move((1, 0, 1), (1, 0, math.inf), 0.0, 1.0), "end = (1.000000, 0.000000, inf)"),
    (lambda s: gsnav.AvatarTracker(s).move((1, 0, 1), (1, 0, 1), NAN, 1.0), "move: t0 = nan: must be finite"),
    (lambda s: gsnav.AvatarTracker(s).move((1, 0, 1), (1, 0, 1), 0.0, NAN), "move: t1 = nan"),
    (lambda s: gsnav.AvatarTracker(s).capsules(math.inf), "AvatarTracker.capsules: time = inf"),
    (lambda s: gsnav.AvatarTracker(s).distance((0, NAN, 0), 0.0), "distance: position = (0.000000, nan, "),
    (lambda s: gsnav.AvatarTracker(s).distance((0, 0, 0), NAN), "AvatarTracker.distance: time = nan"),
    (lambda s: gsnav.AvatarTracker(s).distance((0, 0, 0), 0.0, radius=NAN), "AvatarTracker.distance: radius = nan"),
    (lambda s: gsnav.AvatarTracker(s).distance((0, 0, 0), 0.0, height=-math.inf), "distance: height = -inf"),
    (lambda s: gsnav.AvatarTracker(s).blocked((0, 0, 0), (0, 0, 0), 0.0, radius=NAN), "blocked: radius = nan"),
    (lambda s: gsnav.views_around(gsnav.open_scene("default", gsnav.OpenOptions(density=0.05)), 10**9, 8, 8),
     "views_around: count = 1000000000: must be in [1, 100000]"),
    (lambda s: gsnav.generate_episode(s.navmesh, gsnav.Rng(1), gsnav.EpisodeRules(max_goals=10**6)),
     "EpisodeRules.max_goals = 1000000: times retries_per_goal must be at most 1000000"),
    (lambda s: gsnav.NavMesh.build(gsnav.NavMeshSettings(), np.zeros((3, 3)), np.zeros((1, 3), int), threads=-1),
     "NavMesh::build: threads = -1: must be in [0, 1024]"),
    (lambda s: gsnav.VectorEnv(2, s, episodes=itertools.repeat(gsnav.PointNavEpisode())),
     "episodes: an iterator of more than 1000000"),
    (lambda s: vector(s).reset(seed=range(10**9)), "seed: 1000000000 seeds for 2 environments"),
    (lambda s: vector(s).step(range(10**9)), "VectorEnv.step: 1000000000 actions for 2 environments"),
    (lambda s: gsnav.AvatarTracker(s).blocked((NAN, 0, 0), (0, 0, 0), 0.0), "AvatarTracker.blocked: start = (nan, "),
    (lambda s: gsnav.AvatarTracker(s).blocked((0, 0, 0), (NAN, 0, 0), 0.0), "AvatarTracker.blocked: end = (nan, "),
])
def test_a_number_out_of_range_is_named_at_once(call, words, people):
    start = time.process_time()
    with pytest.raises(gsnav.InvalidArgument) as raised:
        call(people)
    assert words in str(raised.value)
    assert time.process_time() - start < 2


MASKED = np.ma.array([5.0, 0.0, 4.0], mask=[True, False, False])


LONG = range(10**9)


@pytest.mark.parametrize("call", [
    lambda s: gsnav.AvatarTracker(s).set_capsules(LONG), lambda s: s.navmesh.find_path_to_any((5, 0, 4), LONG),
    lambda s: gsnav.BatchSimulator("serial", LONG, gsnav.BatchConfig(), 1, lambda e, k: None),
    lambda s: gsnav.SimulatorConfig(sensors=LONG), lambda s: gsnav.Renderer("serial", s).render(LONG),
    lambda s: gsnav.summarize(LONG), lambda s: gsnav.navmesh_viewpoints(s.navmesh, LONG, 1.0),
    lambda s: gsnav.OpenOptions(meshes=LONG), lambda s: gsnav.SimulatorScene(assets=LONG),
    lambda s: s.navmesh.geodesic_distance((5, 0, 4), np.broadcast_to(np.zeros(3), (10**8, 3))),
    lambda s: gsnav.NavMesh.build(gsnav.NavMeshSettings(), LONG, range(3)),
    lambda s: gsnav.NavMesh.build(gsnav.NavMeshSettings(), np.zeros((3, 3)),
                                  np.broadcast_to(np.uint32(0), (10**10, 3))),
])
def test_a_long_sequence_is_refused_before_it_is_copied(call, people):
    before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    with pytest.raises((TypeError, ValueError, gsnav.InvalidArgument)):
        call(people)
    assert time.process_time() - start < 2
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 10**6  # KB.


@pytest.mark.parametrize("point", [
    [True, False, True], (5.0, np.True_, 4.0), np.array([True, False, True]), MASKED, b"\5\0\4", bytearray(3),
])
def test_bools_masks_and_bytes_are_no_position(point, people):
    for call in (people.navmesh.snap_point, people.navmesh.is_navigable, gsnav.AgentPose().__setattr__):
        with pytest.raises(TypeError):
            call(point) if call.__name__ != "__setattr__" else call("position", point)
    assert people.navmesh.snap_point(np.array([5, 0, 4])) is not None  # integers are


def test_a_mask_is_never_ignored(people):
    episodes = gsnav.generate_episodes(people.navmesh, 2, 1)
    config = gsnav.BatchConfig(rendering=False)
    simulator = gsnav.BatchSimulator("serial", [people], config, 2, lambda e, k: episodes[e])
    simulator.reset()
    ones = np.ma.array([1, 1], mask=[True, True])
    envs = gsnav.VectorEnv(2, people, config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8)))
    envs.reset(seed=1)
    for call in (lambda: simulator.step(ones), lambda: simulator.reset(ones.astype(bool)), lambda: envs.step(ones),
                 lambda: gsnav.NavMesh.build(gsnav.NavMeshSettings(), np.ma.ones((3, 3)), [[0, 1, 2]])):
        with pytest.raises(TypeError, match="mask"):
            call()
    assert len(simulator.step([1, 1]).rewards) == 2 and len(envs.step([1, 1])) == 5
