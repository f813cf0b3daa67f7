# SPDX-License-Identifier: Apache-2.0
"""Capsules in the way of agents, and people who are hidden, against geometry and against scenes without people."""

import math

import habitat_sim
import numpy as np
import pytest
from habitat_sim.gaussian_avatar import GaussianAvatarManager, load_gaussian_avatars
from habitat_sim.utils.common import quat_from_angle_axis
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")
FLOOR = 0.07
PILLAR = [0, 0, -2, 0, 2, -2, 0.2]  # Upright, at (0, -2), 0.2 m thick.


def open_sim(stage, people, monkeypatch, **settings):
    monkeypatch.setenv("GSNAV_PEOPLE", str(people))
    size = {"scene": stage, "width": 24, "height": 16, "depth_sensor": True}
    return habitat_sim.Simulator(make_cfg({**size, **settings}))


def between(p0, p1, q0, q1):
    """Distance between two segments, from their closest points."""
    u, v, w = p1 - p0, q1 - q0, p0 - q0
    a, b, c, d, e = u @ u, u @ v, v @ v, u @ w, v @ w

    def on(s, t):
        return np.linalg.norm(w + s * u - t * v)

    found = []
    for s in (0.0, 1.0):  # The ends of one and the nearest point of the other.
        found.append(on(s, np.clip((e + s * b) / c if c > 0 else 0, 0, 1)))
    for t in (0.0, 1.0):
        found.append(on(np.clip((t * b - d) / a if a > 0 else 0, 0, 1), t))
    det = a * c - b * b
    if det > 1e-12:
        s, t = (b * e - c * d) / det, (a * e - b * d) / det
        if 0 <= s <= 1 and 0 <= t <= 1:
            found.append(on(s, t))
    return min(found)


def gap(base, radius, height, capsules):
    """Distance from an upright capsule to the nearest of others."""
    low, high = base + np.array([0, radius, 0]), base + np.array([0, height - radius, 0])
    return min(between(low, high, c[:3], c[3:6]) - radius - c[6] for c in capsules)


def test_distances_are_those_to_the_capsules_of_people(stage, monkeypatch):
    rng = np.random.default_rng(3)
    with open_sim(stage, 3, monkeypatch) as sim:
        sim.gaussian_time = 1.5
        people = load_gaussian_avatars(sim)
        assert [p.avatar_id for p in people] == [0, 1, 2] and all(p.update() for p in people)
        GaussianAvatarManager(people).update(sim)
        rows = [p.get_navmesh_capsules() for p in people]
        assert all(r.dtype == np.float32 and r.shape[1] == 7 and (r[:, 6] > 0).all() for r in rows)
        extra = np.array([[1.0, 0.2, 1.0, 1.5, 1.4, 1.0, 0.1]], np.float32)
        sim.set_navmesh_dynamic_capsules(extra)
        every = np.concatenate([*rows, extra]).astype(float)
        for _ in range(200):
            # Near to one of them at first, then anywhere.
            at = every[rng.integers(len(every)), :3] * [1, 0, 1] + rng.normal(size=3) * [0.8, 0.1, 0.8]
            radius = rng.uniform(0.05, 0.4)
            want = gap(at, radius, 1.5, every)
            assert sim.distance_to_avatar_proxy_capsules(at, radius, 1.5) == pytest.approx(want, abs=2e-6)
        sim.clear_navmesh_dynamic_capsules()
        far = gap(np.array([1.2, FLOOR, 1.0]), 0.1, 1.5, np.concatenate(rows).astype(float))
        assert sim.distance_to_avatar_proxy_capsules([1.2, FLOOR, 1.0], 0.1, 1.5) == pytest.approx(far, abs=2e-6)


@pytest.mark.parametrize("aside", [0.0, 0.15, 0.29])
def test_an_agent_stops_where_it_touches_a_capsule(stage, monkeypatch, aside):
    with open_sim(stage, 0, monkeypatch, allow_sliding=False) as sim:
        assert sim.avatar_metrics() is None
        sim.set_navmesh_dynamic_capsules(np.array([PILLAR], np.float32))
        radius = sim.get_agent(0).agent_config.radius
        touching = -2 + math.sqrt((radius + 0.2) ** 2 - aside**2)  # z of the agent.
        sim.get_agent(0).set_state(habitat_sim.AgentState([aside, FLOOR, 0], quat_from_angle_axis(0, [0, 1, 0])))
        walked = []
        for _ in range(8):
            blocked = sim.is_step_blocked_by_avatar_proxy_capsules(
                sim.get_agent(0).state.position, sim.get_agent(0).state.position + np.array([0, 0, -0.25]), False
            )
            hit = sim.step("move_forward")["collided"]
            assert blocked == hit
            walked.append((float(sim.get_agent(0).state.position[2]), hit))
        free = [-0.25 * (i + 1) for i in range(8) if -0.25 * (i + 1) > touching + 1e-3]
        assert [z for z, _ in walked[: len(free)]] == pytest.approx(free, abs=1e-5)
        assert not any(hit for _, hit in walked[: len(free)]) and all(hit for _, hit in walked[len(free) :])
        assert walked[-1][0] == pytest.approx(touching, abs=1e-3) and walked[-1][0] > touching
        assert sim.avatar_metrics().collision_rate == pytest.approx((8 - len(free)) / 8)
        # Steps of the PathFinder stop there too, and no more once the capsules are gone.
        step = sim.pathfinder.try_step_no_sliding
        assert step([aside, FLOOR, -1.2], [aside, FLOOR, -3])[2] == pytest.approx(touching, abs=1e-3)
        sim.clear_navmesh_dynamic_capsules()
        assert step([aside, FLOOR, -1.2], [aside, FLOOR, -3])[2] == pytest.approx(-3, abs=1e-5)
        assert sim.step("move_forward")["collided"] is False and sim.avatar_metrics() is None


def test_a_later_mesh_and_another_list_replace_the_capsules(stage, monkeypatch):
    with open_sim(stage, 0, monkeypatch) as sim:
        finder = sim.pathfinder
        sim.set_navmesh_dynamic_capsules([PILLAR])
        assert finder.try_step_no_sliding([0, FLOOR, -1], [0, FLOOR, -3])[2] > -1.75
        settings = habitat_sim.NavMeshSettings()
        settings.agent_radius = 0.3  # Radius of the agent that touches.
        assert sim.recompute_navmesh(finder, settings)
        assert finder.try_step_no_sliding([0, FLOOR, -1], [0, FLOOR, -3])[2] == pytest.approx(-1.5, abs=1e-3)
        sim.set_navmesh_dynamic_capsules(np.empty((0, 7), np.float32))
        assert finder.try_step_no_sliding([0, FLOOR, -1], [0, FLOOR, -3])[2] == pytest.approx(-3, abs=1e-5)
        for wrong in ([[1, 2, 3]], [[*PILLAR[:6], -1.0]], [[*PILLAR[:6], float("nan")]], [PILLAR + [0]],
                      [[1e20, *PILLAR[1:]]]):  # fmt: skip
            with pytest.raises(ValueError, match="set_navmesh_dynamic_capsules"):
                sim.set_navmesh_dynamic_capsules(wrong)


def test_bodies_wider_than_high_are_refused(stage, monkeypatch):
    # Among people a body is a capsule within its height. A radius above half of the height would be cut.
    with open_sim(stage, 0, monkeypatch) as sim:
        sim.set_navmesh_dynamic_capsules([PILLAR])
        at, text = [1, FLOOR, -2], "radius = 0.5, height = 0.8: .*at most half of the height"
        assert sim.distance_to_avatar_proxy_capsules(at, 0.4, 0.8) == pytest.approx(1 - 0.2 - 0.4, abs=1e-6)
        with pytest.raises(ValueError, match=text):
            sim.distance_to_avatar_proxy_capsules(at, 0.5, 0.8)
        with pytest.raises(ValueError, match=text):
            sim.is_step_blocked_by_avatar_proxy_capsules(at, at, True, 0.5, 0.8)
        with pytest.raises(ValueError, match="agent_height = 1e.300: must be finite and within 1e9 m"):
            sim.distance_to_avatar_proxy_capsules(at, 0.1, 1e300)
        settings = habitat_sim.NavMeshSettings()
        settings.agent_radius, settings.agent_height = 0.5, 0.8
        assert sim.recompute_navmesh(sim.pathfinder, settings)
        before = sim.get_agent(0).get_state()
        with pytest.raises(ValueError, match=text):
            sim.pathfinder.try_step([0, FLOOR, -1], [0, FLOOR, -3])
        sim.get_agent(0).agent_config.radius, sim.get_agent(0).agent_config.height = 0.5, 0.8
        with pytest.raises(ValueError, match=text):
            sim.step("move_forward")
        assert sim.get_agent(0).get_state() == before
        sim.clear_navmesh_dynamic_capsules()
        sim.step("move_forward")


def test_bodies_wider_than_high_are_refused_where_people_walk(stage, monkeypatch):
    config = make_cfg({"scene": stage, "width": 8, "height": 8})
    config.agents[0].radius, config.agents[0].height = 0.5, 0.8
    habitat_sim.Simulator(config).close()
    monkeypatch.setenv("GSNAV_PEOPLE", "1")
    with pytest.raises(ValueError, match="AgentConfiguration: radius = 0.5, height = 0.8: "):
        habitat_sim.Simulator(config)


def test_hidden_people_leave_no_trace_in_images_and_still_stop_agents(stage, monkeypatch):
    with open_sim(stage, 0, monkeypatch) as empty, open_sim(stage, 2, monkeypatch) as sim:
        body = sim._tracker(0).capsules(0.0, 0)[:, [0, 2]].mean(0)
        # It looks down at the first person from 3 m: the camera is 1.5 m along the head, which points along -z.
        down = quat_from_angle_axis(-math.pi / 2, [1, 0, 0])
        pose = habitat_sim.AgentState([body[0], FLOOR + 3, body[1] + 1.5], down)
        for each in (empty, sim):
            each.get_agent(0).set_state(pose)
        bare, seen = empty.get_sensor_observations(), sim.get_sensor_observations()
        assert (seen["depth_sensor"] != bare["depth_sensor"]).any()
        before = sim.distance_to_avatar_proxy_capsules(pose.position)
        assert sim.set_gaussian_avatar_visible(0, False) and sim.set_gaussian_avatar_visible(1, False)
        hidden = sim.get_sensor_observations()
        for name, image in bare.items():
            assert np.array_equal(hidden[name], image)
        assert sim.distance_to_avatar_proxy_capsules(pose.position) == before
        assert sim.set_gaussian_avatar_visible(0, True) and sim.set_gaussian_avatar_visible(1, True)
        for name, image in sim.get_sensor_observations().items():
            assert np.array_equal(seen[name], image)
        assert not sim.set_gaussian_avatar_visible(2, False)
        for wrong in (True, 1.0, "1"):
            with pytest.raises(TypeError, match="avatar_id = .*must be an integer"):
                sim.set_gaussian_avatar_visible(wrong, False)
