# SPDX-License-Identifier: Apache-2.0
"""AvatarTracker against the simulator: the same moves among the same people give the same metrics."""

import math
import threading

import gsnav
import numpy as np
import pytest


def test_moves_and_metrics_are_those_of_the_simulator(people):
    scene = people
    episodes = gsnav.generate_episodes(scene.navmesh, 6, 5)
    task = gsnav.TaskConfig.avatar_pointnav()
    sensor = gsnav.SensorSpec(uuid="depth", kind=gsnav.SensorKind.depth, resolution=[4, 4])
    config = gsnav.SimulatorConfig(task=task, sensors=[sensor])
    simulator = gsnav.Simulator(gsnav.Device.parse("cpu"), scene, config)
    tracker = gsnav.AvatarTracker(scene, task.agent_radius, task.agent_height)
    rng = np.random.default_rng(2)
    near = 0
    for episode in episodes:
        simulator.reset(episode)
        world = simulator.world
        tracker.reset()
        for _ in range(60):
            before, t0 = world.agent, world.time
            action = rng.choice([gsnav.Action.move_forward, gsnav.Action.turn_left, gsnav.Action.turn_right])
            action = gsnav.Action(action)
            simulator.step(action)
            forward = action == gsnav.Action.move_forward
            wish = np.array(before.forward()) * (task.forward_step if forward else 0)
            tracker.begin_action()
            reached = tracker.move(before.position, before.position + wish, t0, world.time)
            info = world.last_step
            assert np.allclose(reached, world.agent.position, atol=1e-9)
            assert tracker.action_collided == info.avatar_contact
            assert tracker.action_clearance == pytest.approx(info.avatar_clearance, abs=1e-9)
            assert tracker.distance(world.agent.position, world.time) >= info.avatar_clearance - 1e-3
        want, got = world.metrics(), tracker.metrics()
        for name in ("collision_rate", "psi", "psc", "human_collision", "human_blocked", "steps", "collisions"):
            assert getattr(got, name) == pytest.approx(getattr(want, name), abs=1e-12), name
        near += want.psi > 0
    assert near  # Someone came near in one of the episodes.


def test_a_move_through_a_person_is_blocked(people):
    tracker = gsnav.AvatarTracker(people)
    mesh, rng = people.navmesh, gsnav.Rng(1)
    touched = 0
    for _ in range(300):
        at = np.array(mesh.random_point(rng).position)
        gap = tracker.distance(at, 2.0)
        # The distance falls by at most the length of the way, so that no shorter move can be blocked.
        step = np.array([0.3, 0, 0])
        if tracker.blocked(at, at + step, 2.0):
            touched += 1
            assert gap < 0.3 + 1e-6
        assert tracker.distance(at + step, 2.0) >= gap - 0.3 - 1e-9
    assert touched


def test_threads_share_no_tracker(people):
    tracker, at = gsnav.AvatarTracker(people), people.navmesh.random_point(gsnav.Rng(1)).position
    alone = tracker.distance(at, 2.0)
    wrong, refused, ready = [], [], threading.Barrier(4)

    def run():
        ready.wait()
        for _ in range(500):
            try:
                if tracker.distance(at, 2.0) != alone:
                    wrong.append(1)
                tracker.begin_action()
                tracker.move(at, at, 1.0, 2.0)
            except gsnav.InvalidArgument as e:
                refused.append(str(e))

    threads = [threading.Thread(target=run) for _ in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert not wrong and all("AvatarTracker" in words for words in refused)
    assert tracker.distance(at, 2.0) == alone


def test_bad_values_and_scenes_without_people(people):
    with pytest.raises(gsnav.InvalidArgument, match="radius = -1"):
        gsnav.AvatarTracker(people, radius=-1)
    empty = gsnav.AvatarTracker(gsnav.default_simulator_scene(people=0, density=0.05))
    assert empty.distance([0, 0, 0], 0.0) == math.inf and not empty.blocked([0, 0, 0], [1, 0, 0], 0.0)
    empty.begin_action()
    assert empty.metrics().psi == 0 and empty.action_clearance == math.inf


def test_the_reward_is_the_formula():
    weights = gsnav.RewardConfig(progress=2, slack=-0.5, success=7, proximity=0.25, collision=0.5, wall=0.125)
    got = gsnav.step_reward(weights, 3.0, 2.5, True, 0.25, True, True)
    assert got == pytest.approx(2 * 0.5 - 0.5 + 7 - 0.25 * 0.75 - 0.5 - 0.125)
