# SPDX-License-Identifier: Apache-2.0
"""Odd settings raise errors that name the field and the value."""

import copy
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


def test_types_of_settings(sim, stage):
    sim.seed(np.int64(5))
    for name, wrong in (("random_seed", "abc"), ("gpu_device_id", None), ("allow_sliding", "no"),
                        ("navmesh_settings", 5), ("default_agent_id", 0.0)):  # fmt: skip
        config = small(stage)
        setattr(config.sim_cfg, name, wrong)
        with pytest.raises(TypeError, match=f"{name} = {wrong!r}: must be"):
            habitat_sim.Simulator(config)
    with pytest.raises(TypeError, match="navmesh_settings = 5: must be a habitat_sim.NavMeshSettings"):
        sim.recompute_navmesh(sim.pathfinder, 5)
    finder, at = sim.pathfinder, [0, 0.07, 0]
    for call in (lambda i: finder.get_random_navigable_point(island_index=i), lambda i: finder.snap_point(at, i),
                 lambda i: finder.get_random_navigable_point_near(at, 1.0, island_index=i),
                 finder.island_area, finder.build_navmesh_vertices):  # fmt: skip
        with pytest.raises(TypeError, match="island_index = 1.5: must be an integer"):
            call(1.5)
    assert finder.is_navigable(at, math.inf) and finder.is_navigable([0, 9, 0], 1e300)


def test_settings_that_are_refused_leave_the_simulator_as_it_was(stage):
    with habitat_sim.Simulator(small(stage)) as sim:
        sim.seed(7)
        sim.initialize_agent(0)
        config, state, mesh = sim.config, sim.get_agent(0).get_state(), sim.pathfinder._mesh
        random, image = sim.random.getstate(), sim.get_sensor_observations()["depth_sensor"]
        twice, seed, clock = small("NONE"), small("NONE"), small("NONE")
        twice.agents[0].sensor_specifications[1].uuid = twice.agents[0].sensor_specifications[0].uuid
        seed.sim_cfg.random_seed, clock.sim_cfg.gaussian_time = "abc", math.inf
        for wrong, text in ((twice, "used twice"), (seed, "random_seed"), (clock, "gaussian_time")):
            with pytest.raises((TypeError, ValueError), match=text):
                sim.reconfigure(wrong)
            assert sim.config is config and sim.pathfinder._mesh is mesh and sim.random.getstate() == random
            assert sim.get_agent(0).get_state() == state
            assert np.array_equal(sim.get_sensor_observations()["depth_sensor"], image)


@pytest.mark.parametrize("way", [
    lambda sim: sim.get_agent(0).sensors, lambda sim: sim.sensors, lambda sim: sim.agents[0]._sensors,
])  # fmt: skip
def test_sensors_can_be_drawn_however_they_are_found(stage, way):
    with habitat_sim.Simulator(small(stage)) as sim:
        sensor = way(sim)["color_sensor"]
        assert np.array_equal(sensor.get_observation(), sim.get_sensor_observations()["color_sensor"])
        sim.remove_sensor("color_sensor")
        with pytest.raises(RuntimeError, match="sensor 'color_sensor' belongs to no simulator"):
            sensor.get_observation()


def test_a_sensor_cannot_get_another_lens_and_a_copy_of_its_specification_can(stage):
    with habitat_sim.Simulator(small(stage)) as sim:
        spec = sim.get_sensor("color_sensor").specification()
        for name, value in (("hfov", 30), ("near", "x"), ("resolution", [4, 4]), ("noise_model", "a")):
            before = getattr(spec, name)
            with pytest.raises(NotImplementedError, match=f"gsnav.*changing {name} of sensor 'color_sensor'"):
                setattr(spec, name, value)
            assert getattr(spec, name) == before
        with pytest.raises(TypeError):
            spec.resolution[0] = 4
        other = copy.copy(spec)
        assert other == spec and type(other.resolution) is list
        other.uuid, other.hfov, other.resolution = "narrow", 30, [4, 6]
        assert sim.add_sensor(other).get_observation().shape == (4, 6, 4) and spec != other
        wide, spec.position = sim.get_sensor_observations()["color_sensor"], [0, 0.5, 0]
        assert np.array_equal(sim.get_sensor_observations()["color_sensor"], wide)
        sim.get_sensor("color_sensor").set_transformation_from_spec()
        assert not np.array_equal(sim.get_sensor_observations()["color_sensor"], wide)


def test_the_number_of_people_may_be_empty_and_is_checked_without_a_scene(stage, monkeypatch):
    monkeypatch.setenv("GSNAV_PEOPLE", "")
    with habitat_sim.Simulator(small(stage)) as made:
        assert made.get_gaussian_avatar_ids() == []
    monkeypatch.setenv("GSNAV_PEOPLE", "x")
    with pytest.raises(ValueError, match="GSNAV_PEOPLE = x"):
        habitat_sim.Simulator(small("NONE"))


@pytest.mark.parametrize("text", ["99999", "1001", "-1", "x", "2.5", "9" * 5000])
def test_the_number_of_people_has_a_range(stage, monkeypatch, text):
    monkeypatch.setenv("GSNAV_PEOPLE", text)
    with pytest.raises(ValueError, match=f"GSNAV_PEOPLE = {text[:20]}.*must be a number of people in .0, 1000."):
        habitat_sim.Simulator(small(stage))
