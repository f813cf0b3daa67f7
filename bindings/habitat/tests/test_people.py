# SPDX-License-Identifier: Apache-2.0
"""People in the simulator: clock, queries, blocked moves and metrics, with the names of Habitat-GS."""

import math

import habitat_sim
import numpy as np
import pytest
from habitat_sim.utils.common import quat_from_angle_axis
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


@pytest.fixture(scope="module")
def people(stage):
    """Keeps the scene with people, which simulators share."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("GSNAV_PEOPLE", "3")
        made = habitat_sim.Simulator(make_cfg({"scene": stage, "width": 8, "height": 8}))
    with made:
        yield made


@pytest.fixture
def sim(stage, people, monkeypatch):
    monkeypatch.setenv("GSNAV_PEOPLE", "3")
    monkeypatch.setenv("GSNAV_ACTION_SECONDS", "0.25")
    with habitat_sim.Simulator(make_cfg({"scene": stage, "width": 8, "height": 8, "seed": 3})) as made:
        yield made


def capsules_apart(sim, point, radius, height):
    """Distance by the library's own tracker at the present time."""
    body = sim.get_agent(0).agent_config
    scene = gsnav.SimulatorScene(sim._stage.scene, sim.pathfinder._mesh)
    return gsnav.AvatarTracker(scene, body.radius, body.height).distance(point, sim.gaussian_time, radius, height)


def test_distances_shrink_by_the_radius_and_change_with_time(sim):
    point = list(sim.get_agent(0).get_state().position)
    thin = sim.distance_to_avatar_proxy_capsules(point, 0.1, 1.5)
    assert thin == capsules_apart(sim, point, 0.1, 1.5)
    # A wider body has its axis ends elsewhere, so only the bound by the radius is exact.
    assert thin - 0.2 - 0.2 <= sim.distance_to_avatar_proxy_capsules(point, 0.3, 1.5) < thin
    body = sim.get_agent(0).agent_config
    assert sim.distance_to_avatar_proxy_capsules(point) == capsules_apart(sim, point, body.radius, body.height)
    sim.gaussian_time = 3.0
    assert sim.distance_to_avatar_proxy_capsules(point, 0.1, 1.5) != thin
    assert sim.get_gaussian_avatar_ids() == [0, 1, 2]


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_questions_with_numbers_that_are_not_finite_are_errors(sim, stage, monkeypatch, wrong):
    monkeypatch.setenv("GSNAV_PEOPLE", "0")
    with habitat_sim.Simulator(make_cfg({"scene": stage, "width": 8, "height": 8})) as alone:
        for each in (sim, alone):
            at = list(each.get_agent(0).get_state().position)
            off = [at[0], wrong, at[2]]
            for name, call in (
                ("agent_base_pos", lambda: each.distance_to_avatar_proxy_capsules(off)),
                ("agent_radius", lambda: each.distance_to_avatar_proxy_capsules(at, wrong)),
                ("agent_height", lambda: each.distance_to_avatar_proxy_capsules(at, agent_height=wrong)),
                ("start", lambda: each.is_step_blocked_by_avatar_proxy_capsules(off, at)),
                ("end", lambda: each.is_step_blocked_by_avatar_proxy_capsules(at, off)),
                ("agent_radius", lambda: each.is_step_blocked_by_avatar_proxy_capsules(at, at, True, wrong)),
            ):
                with pytest.raises(ValueError, match=f"avatar_proxy_capsules: {name} = .*{wrong}.*: must be finite"):
                    call()


def test_a_long_step_to_nowhere_stays_among_people_too(stage, people, monkeypatch):
    for count in ("0", "3"):
        monkeypatch.setenv("GSNAV_PEOPLE", count)
        config = make_cfg({"scene": stage, "width": 8, "height": 8})
        config.agents[0].action_space["leap"] = habitat_sim.ActionSpec("move_forward", habitat_sim.ActuationSpec(50.0))
        with habitat_sim.Simulator(config) as made:
            agent, off = made.get_agent(0), [0.0, 9.0, 0.0]
            before = agent.get_state().position
            assert made.step("leap")["collided"] and np.allclose(agent.get_state().position, before, atol=1e-5)
            agent.set_state(habitat_sim.AgentState(off))
            assert made.step("move_forward")["collided"] and np.allclose(agent.get_state().position, off, atol=1e-5)


def test_people_stop_moves_and_count(sim):
    """Walk towards a person from 0.3 m in front of it until it blocks."""
    rng, blocked = gsnav.Rng(4), None
    mesh = sim.pathfinder._mesh
    for i in range(3000):
        at = np.array(mesh.random_point(rng).position)
        heading = 2 * math.pi * i / 50
        end = at + 0.25 * np.array([-math.sin(heading), 0, -math.cos(heading)])
        if sim.distance_to_avatar_proxy_capsules(at) > 0.02 and sim.is_step_blocked_by_avatar_proxy_capsules(at, end):
            blocked = at, heading
            break
    assert blocked is not None
    sim.gaussian_auto_play = False  # The person stands.
    sim.get_agent(0).set_state(habitat_sim.AgentState(blocked[0], quat_from_angle_axis(blocked[1], [0, 1, 0])))
    assert sim.avatar_metrics().steps == 0
    sim.step("move_forward")
    metrics, (gap, hit) = sim.avatar_metrics(), sim.avatar_step()
    assert hit and metrics.collision_rate == 1 and metrics.human_blocked
    assert 0 < gap < 1e-3  # The gap that a stopped move keeps.
    assert metrics.psi > 0.99 / 3 and metrics.min_clearance == gap
    sim.step("turn_left")
    metrics = sim.avatar_metrics()
    assert metrics.steps == 2 and metrics.collision_rate == 0.5 and not sim.avatar_step()[1]
    sim.reset()
    assert sim.avatar_metrics().steps == 0


def test_the_clock_of_people(sim):
    sim.reset()
    sim.step("turn_left")
    sim.step_physics(1 / 60)
    assert sim.gaussian_time == 0.25
    sim.gaussian_time_min, sim.gaussian_time_max = 1.0, 3.0
    sim.gaussian_time = 3.5
    assert sim.gaussian_time == 1.5 and sim.gaussian_duration == 2 and sim.gaussian_interval == (1, 3)
    sim.gaussian_time_loop = False
    sim.gaussian_time = 3.5
    assert sim.gaussian_time == 3
    sim.gaussian_auto_play = False
    sim.step("turn_left")
    assert sim.gaussian_time == 3
    with pytest.raises(ValueError, match="gaussian_time = nan"):
        sim.gaussian_time = float("nan")


def test_scenes_without_people_and_calls_that_are_not_served(stage, monkeypatch):
    with habitat_sim.Simulator(make_cfg({"scene": stage, "width": 8, "height": 8})) as sim:
        point = sim.get_agent(0).get_state().position
        assert sim.distance_to_avatar_proxy_capsules(point) == math.inf and sim.get_gaussian_avatar_ids() == []
        assert not sim.is_step_blocked_by_avatar_proxy_capsules(point, point)
        assert sim.avatar_metrics() is None and sim.avatar_step() == (math.inf, False)
        assert not sim.set_gaussian_avatar_visible(0, False)
        for name in ("update_gaussian_avatar", "update_gaussian_avatar_pose", "update_gaussian_avatar_bounds"):
            with pytest.raises(NotImplementedError, match=f"gsnav.*{name}"):
                getattr(sim, name)()
    monkeypatch.setenv("GSNAV_PEOPLE", "many")
    with pytest.raises(ValueError, match="GSNAV_PEOPLE = many"):
        habitat_sim.Simulator(make_cfg({"scene": stage}))
