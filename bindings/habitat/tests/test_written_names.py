# SPDX-License-Identifier: Apache-2.0
"""Names that gsnav does not serve cannot be written, and those that habitat-lab writes can."""

import abc
import copy
import pathlib
import pickle
import re

import habitat_sim
import magnum as mn
import pytest
from habitat_sim.utils.settings import make_cfg

pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


def small(scene):
    return make_cfg({"scene": scene, "width": 8, "height": 8})


@pytest.fixture(scope="module")
def sim(stage):
    with habitat_sim.Simulator(small(stage)) as made:
        yield made


NAMES = ("navmesh_visualization", "frustum_culling", "renderer", "gfx_replay_manager", "active_dataset")


@pytest.mark.parametrize("name", [*NAMES, "no_such_name"])
def test_a_simulator_refuses_to_write_names_that_are_not_served(sim, name):
    with pytest.raises(NotImplementedError, match=f"gsnav serves navigation only: habitat_sim.Simulator.{name}$"):
        setattr(sim, name, True)
    assert not hasattr(sim, name)


def test_a_subclass_has_names_of_its_own_but_none_of_those(stage):
    class Mine(habitat_sim.Simulator):
        def __init__(self, config):
            self.mine = 1  # Before the base, as in habitat-lab.
            super().__init__(config)

        @property
        def renderer(self):
            return self._mine

        @renderer.setter
        def renderer(self, value):
            self._mine = value

    with Mine(small(stage)) as made:
        made.mine, made.other, made.renderer = 2, 3, 4
        assert (made.mine, made.other, made.renderer) == (2, 3, 4)
        for name in set(NAMES) - {"renderer"}:
            with pytest.raises(NotImplementedError, match=f"gsnav.*habitat_sim.Simulator.{name}$"):
                setattr(made, name, True)
        made.step = lambda action: "replaced"
        assert made.step("stop") == "replaced"


SETTINGS = [
    habitat_sim.SimulatorConfiguration, habitat_sim.AgentConfiguration, habitat_sim.Configuration,
    habitat_sim.CameraSensorSpec, habitat_sim.EquirectangularSensorSpec, habitat_sim.FisheyeSensorDoubleSphereSpec,
    habitat_sim.NavMeshSettings, habitat_sim.ShortestPath, habitat_sim.MultiGoalShortestPath, habitat_sim.RigidState,
    habitat_sim.physics.VelocityControl,
]  # fmt: skip


@pytest.mark.parametrize("kind", SETTINGS)
def test_settings_refuse_names_that_are_not_served(kind):
    for made in (kind(), copy.copy(kind()), copy.deepcopy(kind()), pickle.loads(pickle.dumps(kind()))):
        with pytest.raises(NotImplementedError, match=f"gsnav.*{kind.__name__}.*no_such_field"):
            made.no_such_field = 1
        assert not hasattr(made, "no_such_field")


@pytest.mark.parametrize("kind", SETTINGS[:6])
def test_equal_settings_stay_equal_and_fields_can_be_written(kind):
    a, b = kind(), pickle.loads(pickle.dumps(kind()))
    assert a == b and copy.deepcopy(a) == b
    name, value = ("uuid", "other") if hasattr(a, "uuid") else next((k, v) for k, v in vars(a).items() if k[0] != "_")
    setattr(a, name, value if name == "uuid" else "other")
    assert a != b and getattr(a, name) == "other"


def test_subclasses_of_settings_elsewhere_are_open():
    class Mine(habitat_sim.CameraSensorSpec):
        pass

    made = Mine()
    made.anything = 1
    assert made.anything == 1


def test_sensors_nodes_and_the_batch_renderer(sim, stage):
    sensor = sim.get_sensor("color_sensor")
    for made, name in ((sensor.node, "semantic_id"), (sim.pathfinder, "no_such_name")):
        with pytest.raises(NotImplementedError, match=f"gsnav.*{type(made).__name__}.{name}"):
            setattr(made, name, 1)
        assert not hasattr(made, name)
    for name in ("near_plane_dist", "zoom", "framebuffer_size"):
        with pytest.raises(NotImplementedError, match=f"gsnav.*Sensor.{name}"):
            setattr(sensor, name, 1)
        with pytest.raises(NotImplementedError, match=f"gsnav.*Sensor.{name}"):
            getattr(sensor, name)
    config = small(stage)
    config.enable_batch_renderer = True
    with pytest.raises(NotImplementedError, match="gsnav.*enable_batch_renderer"):
        habitat_sim.Simulator(config)


def test_parts_of_a_simulator_have_their_own_names_only(sim):
    agent, finder, control = sim.get_agent(0), sim.pathfinder, habitat_sim.agent.ObjectControls()
    action = agent.agent_config.action_space["move_forward"]
    objects = [agent, agent.get_state(), habitat_sim.AgentState(), habitat_sim.SixDOFPose(), agent.controls, control,
               sim.get_active_scene_graph(), action, action.actuation, habitat_sim.HitRecord(), sim.metadata_mediator,
               sim.get_object_template_manager(), sim.make_greedy_follower(), habitat_sim.registry,
               habitat_sim.gaussian_avatar.GaussianAvatar(sim, 0)]  # fmt: skip
    for made in (*objects, copy.copy(agent.get_state()), copy.deepcopy(action.actuation)):
        for name in ("velocity", "amout"):
            with pytest.raises(NotImplementedError, match=f"gsnav.*{type(made).__name__}.{name}"):
                getattr(made, name)
            with pytest.raises(NotImplementedError, match=f"gsnav.*{type(made).__name__}.{name}"):
                setattr(made, name, 1)
            assert not hasattr(made, name)
    for made in (agent.scene_node, habitat_sim.SceneNode, type(agent), type(finder), habitat_sim.NavMeshSettings()):
        for name in ("semantic_id", "cumulative_bb"):
            with pytest.raises(NotImplementedError, match=f"gsnav.*{name}"):
                getattr(made, name)
    with pytest.raises(NotImplementedError, match="gsnav.*SixDOFPose.sensor_states$"):
        habitat_sim.SixDOFPose().sensor_states = {}
    with pytest.raises(NotImplementedError, match="gsnav serves navigation only: magnum.Color4.hue$"):
        mn.Color4().hue

    class Abstract(habitat_sim.Agent, abc.ABC):
        pass

    assert issubclass(Abstract, habitat_sim.Agent)
    with pytest.raises(NotImplementedError, match="gsnav.*MetadataMediator.active_dataset = 'x'"):
        sim.metadata_mediator.active_dataset = "x"
    sim.metadata_mediator.active_dataset = sim.metadata_mediator.active_dataset
    assert pickle.loads(pickle.dumps(agent.get_state())) == agent.get_state()


@pytest.mark.parametrize("line, name", [
    ("from habitat_sim import Bogus", "habitat_sim.Bogus"), ("from magnum import gl", "magnum.gl"),
    ("from habitat_sim.utils import viz_utils", "habitat_sim.utils.viz_utils"),
    ("from habitat_sim.nav import Bogus", "habitat_sim.nav.Bogus"), ("import magnum.gl", "magnum.gl"),
    ("import habitat_sim.utils.viz_utils", "habitat_sim.utils.viz_utils"),
    ("from corrade import utility", "corrade.utility"),
])  # fmt: skip
def test_imports_that_are_not_served_say_so(line, name):
    for expected in (NotImplementedError, ImportError):  # Scripts catch the second.
        with pytest.raises(expected, match=f"^gsnav serves navigation only: {name}$"):
            exec(line)
    exec("from habitat_sim.nav import PathFinder; from magnum import Vector3; import habitat_sim.nav")


@pytest.mark.parametrize("made, name", [
    (mn.Matrix4, "orthographic_projection"), (mn.Range3D(), "x"), (mn.Color4(1, 0, 0, 1), "to_hsv"),
    (mn.Quaternion(), "to_euler"), (habitat_sim.scene.SceneNode(), "semantic_id"),
])  # fmt: skip
def test_members_that_are_not_served_say_so(made, name):
    with pytest.raises(NotImplementedError, match=f"gsnav.*{name}$"):
        getattr(made, name)
    assert not hasattr(made, name)


SERVED = {
    habitat_sim.SimulatorConfiguration: {
        "scene_id", "random_seed", "default_agent_id", "gpu_device_id", "allow_sliding", "navmesh_settings",
        "gaussian_time", "gaussian_auto_play", "gaussian_time_min", "gaussian_time_max", "gaussian_time_loop"},
    habitat_sim.Configuration: {"sim_cfg", "agents", "enable_batch_renderer"},
    habitat_sim.AgentConfiguration: {"height", "radius", "sensor_specifications", "action_space"},
    habitat_sim.CameraSensorSpec: {
        "uuid", "sensor_type", "sensor_subtype", "noise_model", "noise_model_kwargs", "gpu2gpu_transfer", "position",
        "orientation", "resolution", "near", "far", "clear_color", "hfov"},
}  # fmt: skip


def test_the_guide_lists_the_fields_without_effect():
    text = (pathlib.Path(__file__).resolve().parents[3] / "docs/guide/habitat_lab.md").read_text()
    table = text.partition("accepted and without effect")[2].partition("\n\n")[2].partition("\n\n")[0]
    listed = {name for row in table.splitlines() for name in re.findall("`([a-z_]+)`", row.rpartition(" | ")[2])}
    fields = {kind: {name for name in vars(kind()) if name[0] != "_"} for kind in SERVED}
    assert all(SERVED[kind] <= fields[kind] for kind in SERVED)
    assert listed == {"include_static_objects"}.union(*(fields[kind] - SERVED[kind] for kind in SERVED))
