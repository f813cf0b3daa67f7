# SPDX-License-Identifier: Apache-2.0
"""Colour images show the sensor's clear colour where nothing is drawn, in rooms without ceilings."""

import math

import habitat_sim
import magnum as mn
import numpy as np
import pytest
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")
COLOR, DEPTH = habitat_sim.SensorType.COLOR, habitat_sim.SensorType.DEPTH


def camera(uuid, kind=COLOR, spec=habitat_sim.CameraSensorSpec, **fields):
    made = spec()
    made.uuid, made.sensor_type, made.resolution, made.orientation = uuid, kind, [24, 32], [0.6, 0, 0]
    for name, value in fields.items():
        setattr(made, name, value)
    return made


def simulator(scene, *specs):
    config = make_cfg({"scene": scene})
    config.agents[0].sensor_specifications = list(specs)
    sim = habitat_sim.Simulator(config)
    sim.initialize_agent(0, habitat_sim.AgentState([0, 0.07, 0]))
    return sim


def bytes_of(color):
    return [round(255 * c) for c in color]


SKY, GREEN = [0.2, 0.4, 1.0, 1.0], mn.Color4(0, 1, 0)


@pytest.mark.parametrize("together", [False, True])  # In one call for many environments, as on a GPU.
@pytest.mark.parametrize("spec", [habitat_sim.CameraSensorSpec, habitat_sim.EquirectangularSensorSpec])
def test_each_sensor_has_its_colour_behind_the_scene(stage, spec, together, monkeypatch):
    monkeypatch.setattr("habitat_sim._draw._together", lambda device: together)
    specs = [camera("plain", spec=spec), camera("sky", spec=spec, clear_color=SKY),
             camera("green", spec=spec, clear_color=GREEN), camera("depth", DEPTH, spec)]  # fmt: skip
    with simulator(stage, *specs) as sim:
        assert sim.sensors["sky"].specification().clear_color == mn.Color4(*SKY)
        for _ in range(2):
            seen = sim.get_sensor_observations()
            empty = seen["depth"] == 0
            if spec is not habitat_sim.CameraSensorSpec:  # A pixel at the edge of a wall is interpolated.
                inner = [np.roll(empty, by, axis) for by in (-1, 1) for axis in (0, 1)]
                walls, empty = ~empty & ~np.any(inner, 0), empty & np.all(inner, 0)
            else:
                walls = ~empty
            assert empty.sum() > 100 and walls.sum() > 100
            for name, color in (("plain", [0, 0, 0, 1]), ("sky", SKY), ("green", [0, 1, 0, 1])):
                assert (seen[name][empty] == bytes_of(color)).all()
                assert (seen[name][walls] == seen["plain"][walls]).all()
            sim.step("turn_left")


def test_simulators_of_one_scene_keep_their_colours(stage):
    up = {"orientation": [math.pi / 2, 0, 0]}
    with simulator(stage, camera("c", **up)) as a, simulator(stage, camera("c", clear_color=SKY, **up)) as b:
        for _ in range(2):
            for sim, color in ((a, [0, 0, 0, 1]), (b, SKY)):
                assert (sim.get_sensor_observations()["c"] == bytes_of(color)).all()
        a.sensors["c"].specification().clear_color = SKY  # As Habitat-Sim reads it at each drawing.
        assert (a.get_sensor_observations()["c"] == bytes_of(SKY)).all()


def test_the_colour_shines_through_gaussians_by_their_alpha():
    flat = {"scene": "default", "width": 32, "height": 24, "depth_sensor": True}
    config = make_cfg(flat)
    ahead, half = {"orientation": [0, 0, 0]}, math.sqrt(0.5)
    config.agents[0].sensor_specifications = [camera("a", **ahead), camera("b", clear_color=SKY, **ahead)]
    with habitat_sim.Simulator(config) as sim:
        # Outside of the flat, 4 m high, looking at it along +x.
        sim.get_agent(0).set_state(habitat_sim.AgentState([-3, 2.5, 3], [0, -half, 0, half]))
        seen = sim.get_sensor_observations()
        node = sim.sensors["a"].node
        q = node.absolute_rotation
        shown = gsnav.FreeSensors("cpu:1", gsnav.open_scene("default"), [
            gsnav.SensorSpec(uuid="alpha", kind=gsnav.SensorKind.alpha, resolution=[24, 32]),
        ]).render([(list(node.absolute_translation), [q.scalar, *q.vector])])["alpha"]  # fmt: skip
    assert 0.05 < shown.mean() < 0.95 and ((shown > 0.1) & (shown < 0.9)).any()
    want = seen["a"][..., :3] + 255 * (1 - shown[..., None]) * np.array(SKY[:3])
    assert np.abs(seen["b"][..., :3] - np.clip(want, 0, 255)).max() <= 1


def test_an_empty_scene_also_has_the_alpha():
    with simulator("NONE", camera("c", clear_color=[0.1, 0.2, 0.3, 1])) as sim:  # Rounded as in scenes.
        assert sim.get_sensor_observations()["c"][0, 0].tolist() == [26, 51, 77, 255]
    with simulator("NONE", camera("c", clear_color=[1, 0.5, 0, 0.25])) as sim:
        assert (sim.get_sensor_observations()["c"] == [255, 128, 0, 64]).all()


def test_colours_that_are_not_served_or_not_numbers_name_the_sensor(stage):
    fish = camera("fish", spec=habitat_sim.FisheyeSensorDoubleSphereSpec, clear_color=SKY)
    for spec in (camera("glass", clear_color=[1, 0, 0, 0.5]), fish):
        with pytest.raises(NotImplementedError, match=f"gsnav.*{spec.uuid}.*clear_color"):
            simulator(stage, spec)
        with simulator(stage, camera("c")) as sim:
            with pytest.raises(NotImplementedError, match=f"gsnav.*{spec.uuid}.*clear_color"):
                sim.add_sensor(spec)
    with pytest.raises(ValueError, match="'c': clear_color = .*nan.*: must be finite"):
        simulator("NONE", camera("c", clear_color=[0, math.nan, 0, 1]))
    fish.clear_color, fish.sensor_type = mn.Color4(0, 0, 0, 1), COLOR
    with simulator(stage, fish, camera("d", DEPTH, clear_color=[1, 1, 1, 0])) as sim:
        assert sim.get_sensor_observations()["fish"].shape == (24, 32, 4)
