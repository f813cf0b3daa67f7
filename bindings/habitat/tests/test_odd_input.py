# SPDX-License-Identifier: Apache-2.0
"""Odd settings raise errors that name the field and the value."""

import math

import habitat_sim
import magnum as mn
import numpy as np
import pytest
from habitat_sim.utils.settings import make_cfg

pytest.importorskip("gsnav")
quaternion = pytest.importorskip("quaternion")


def small(scene, **fields):
    config = make_cfg({"scene": scene, "width": 8, "height": 8, "depth_sensor": True})
    for name, value in fields.items():
        setattr(config.agents[0].sensor_specifications[0], name, value)
    return config


@pytest.fixture(scope="module")
def sim(stage):
    with habitat_sim.Simulator(small(stage)) as made:
        yield made


def test_rotations_of_length_0_are_errors_and_change_nothing(sim):
    agent, before = sim.get_agent(0), sim.get_agent(0).get_state()
    for wrong in (quaternion.quaternion(0, 0, 0, 0), mn.Quaternion(mn.Vector3(0), 0.0), [0, 0, 0, 0],
                  [0, math.nan, 0, 1]):  # fmt: skip
        with pytest.raises(ValueError, match="set_state: AgentState.rotation = .*length 0"):
            agent.set_state(habitat_sim.AgentState([0, 0.07, 0], wrong))
        state = agent.get_state()
        state.position = [0, 0.07, 0]
        state.sensor_states["depth_sensor"].rotation = wrong
        with pytest.raises(ValueError, match="set_state: SixDOFPose.rotation = .*length 0"):
            agent.set_state(state, infer_sensor_states=False)
    with pytest.raises(ValueError, match="SceneNode.rotation = .*length 0"):
        agent.scene_node.rotation = mn.Quaternion(mn.Vector3(0), 0.0)
    state = agent.get_state()
    state.position = [0, 1]
    with pytest.raises(ValueError, match="AgentState.position = .*three numbers"):
        agent.set_state(state)
    assert agent.get_state() == before


@pytest.mark.parametrize("fields, text", [
    ({"hfov": 0}, "hfov = 0.*\\(0, 180\\)"), ({"hfov": 180}, "hfov = 180.*\\(0, 180\\)"),
    ({"hfov": mn.Rad(4)}, "hfov = 229.*\\(0, 180\\)"), ({"hfov": math.nan}, "hfov = nan.*\\(0, 180\\)"),
    ({"hfov": "wide"}, "hfov = 'wide': must be a number"), ({"near": None}, "near = None: must be a number"),
    ({"near": 0}, "near_plane = 0"), ({"far": 0.001}, "far_plane = 0.001"),
    ({"resolution": [100000, 8]}, "resolution = 100000.*16384"), ({"position": [0, math.nan, 0]}, "position = .*nan"),
    ({"orientation": [0, 0, math.inf]}, "orientation = .*inf"),
])  # fmt: skip
@pytest.mark.parametrize("scene", ["NONE", "stage"])
def test_fields_of_sensors_are_checked_when_the_simulator_takes_them(fields, text, scene, stage, sim):
    config = small(stage if scene == "stage" else scene, **fields)
    with pytest.raises(ValueError, match=f"color_sensor.*{text}"):
        habitat_sim.Simulator(config)
    with pytest.raises(ValueError, match=f"color_sensor.*{text}"):
        sim.add_sensor(config.agents[0].sensor_specifications[0])


def test_no_noise_can_be_none(stage):
    with habitat_sim.Simulator(small(stage, noise_model=None)) as sim:
        assert sim.get_sensor_observations()["color_sensor"].shape == (8, 8, 4)


@pytest.mark.parametrize("settings", [{"bogus": 1}, {"sigma": "a"}])
def test_settings_of_noise_are_checked_with_the_sensor(stage, settings):
    config = small(stage, noise_model="GaussianNoiseModel", noise_model_kwargs=settings)
    with pytest.raises((TypeError, ValueError), match=f"color_sensor.*noise_model_kwargs = .*{list(settings)[0]}"):
        habitat_sim.Simulator(config)


@pytest.mark.parametrize("text", ["a", "0", "nan", "inf", "1s"])
def test_the_time_of_an_action_names_its_variable(sim, monkeypatch, text):
    before = sim.get_agent(0).get_state(), sim.get_world_time()
    monkeypatch.setenv("GSNAV_ACTION_SECONDS", text)
    with pytest.raises(ValueError, match=f"GSNAV_ACTION_SECONDS = {text}: must be in .0, 3600. seconds"):
        sim.step("move_forward")
    assert (sim.get_agent(0).get_state(), sim.get_world_time()) == before


def test_numbers_of_agents(sim, stage):
    zero = np.int64(0)
    assert set(sim.get_sensor_observations(zero)) == {"color_sensor", "depth_sensor"}
    assert list(sim.get_sensor_observations([zero])) == [0] and "color_sensor" in sim.reset(zero)
    assert sim.get_agent(zero) is sim.get_agent(0) and list(sim.step({zero: "turn_left"})) == [0]
    for call in (sim.get_agent, sim.get_sensor_observations, sim.last_state, sim.initialize_agent):
        with pytest.raises(IndexError, match="no agent 9; there are 1"):
            call(9)
    config = small(stage)
    for number in (1, -1):
        config.sim_cfg.default_agent_id = number
        with pytest.raises(ValueError, match=f"default_agent_id = {number}: there are 1 agents"):
            habitat_sim.Simulator(config)


@pytest.mark.parametrize("text", ["99999", "1001", "-1", "x", "2.5", "9" * 5000])
def test_the_number_of_people_has_a_range(stage, monkeypatch, text):
    monkeypatch.setenv("GSNAV_PEOPLE", text)
    with pytest.raises(ValueError, match=f"GSNAV_PEOPLE = {text[:20]}.*must be a number of people in .0, 1000."):
        habitat_sim.Simulator(small(stage))
