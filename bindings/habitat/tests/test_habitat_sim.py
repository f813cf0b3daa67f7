# SPDX-License-Identifier: Apache-2.0
"""The simulator in a room of boxes: poses, steps, clock, and images against plane geometry."""

import math
import os
import pathlib
import re
import subprocess
import sys

import habitat_sim
import magnum as mn
import numpy as np
import pytest
from habitat_sim.utils.common import quat_from_angle_axis
from habitat_sim.utils.settings import make_cfg

pytest.importorskip("gsnav")
quaternion = pytest.importorskip("quaternion")
NORTH_WALL = -4.4  # z of its inner face, metres.


def camera(uuid, kind, spec=habitat_sim.CameraSensorSpec, **fields):
    made = spec()
    made.uuid, made.sensor_type, made.resolution = uuid, kind, [32, 48]
    for name, value in fields.items():
        setattr(made, name, value)
    return made


COLOR, DEPTH = habitat_sim.SensorType.COLOR, habitat_sim.SensorType.DEPTH


@pytest.fixture
def sim(stage):
    config = make_cfg(
        {"scene": stage, "width": 48, "height": 32, "depth_sensor": True, "semantic_sensor": True, "seed": 5}
    )
    with habitat_sim.Simulator(config) as made:
        yield made


def place(sim, position, angle=0.0, axis=(0, 1, 0)):
    agent = sim.get_agent(0)
    state = habitat_sim.AgentState(position, quat_from_angle_axis(angle, axis))
    agent.set_state(state)
    return agent


def test_observations_have_the_types_and_shapes_of_habitat(sim):
    seen = sim.reset()
    assert {k: (v.dtype.name, v.shape) for k, v in seen.items()} == {
        "color_sensor": ("uint8", (32, 48, 4)),
        "depth_sensor": ("float32", (32, 48)),
        "semantic_sensor": ("uint32", (32, 48)),
    }
    kept = seen["color_sensor"].copy()
    after = sim.step("turn_left")
    assert (seen["color_sensor"] == kept).all() and (after["color_sensor"] != kept).any()
    assert (kept[..., 3] == 255).all() and after["collided"] is False


def test_depth_is_planar_and_the_top_row_is_up(sim):
    place(sim, [0, 0.07, 0])  # Looks along -z to the wall, 4.4 m away.
    depth = sim.get_sensor_observations()["depth_sensor"]
    assert np.allclose(depth[16, 20:28], 4.4, atol=1e-3)
    # The floor is 1.5 m below the camera. A row below the horizon by t pixels sees it at 1.5 f / t.
    f = 24.0
    for row in range(26, 32):
        assert np.allclose(depth[row, 20:28], 1.5 * f / (row + 0.5 - 16), rtol=1e-3)
    assert depth[0, 24] == 0 or depth[0, 24] == pytest.approx(4.4, abs=1e-3)


def test_a_camera_tells_its_angle_of_view(stage):
    config = make_cfg({"scene": stage, "hfov": 70})
    around = habitat_sim.EquirectangularSensorSpec()
    around.uuid, around.sensor_type = "around", COLOR
    config.agents[0].sensor_specifications.append(around)
    with habitat_sim.Simulator(config) as sim:
        sensors = sim.agents[0].sensors
        assert sensors["color_sensor"].hfov == mn.Deg(70) and not hasattr(sensors["around"], "hfov")
        with pytest.raises(NotImplementedError, match="gsnav.*hfov of sensor 'color_sensor'"):
            sensors["color_sensor"].hfov = mn.Deg(60)


@pytest.mark.parametrize("hfov", [60.0, mn.Deg(60), mn.Rad(math.pi / 3)])
def test_an_angle_of_view_in_either_unit_draws_that_angle(stage, hfov):
    config = make_cfg({"scene": stage, "color_sensor": False, "depth_sensor": True, "hfov": hfov, "width": 32,
                       "height": 32})  # fmt: skip
    with habitat_sim.Simulator(config) as sim:
        assert sim.agents[0].sensors["depth_sensor"].hfov == mn.Deg(60)
        place(sim, [0, 0.07, 0])
        depth = sim.get_sensor_observations()["depth_sensor"]
        # As above: a row t pixels below the horizon sees the floor at 1.5 f / t.
        f = 16 / math.tan(math.pi / 6)
        assert np.allclose(depth[30, 12:20], 1.5 * f / 14.5, rtol=1e-3)


def test_any_pose_is_taken_without_snapping(sim):
    agent = place(sim, [1.0, 7.5, 2.0], 1.1, (0.2, 0.9, -0.4))
    state = agent.get_state()
    assert state.position.dtype == np.float32 and np.allclose(state.position, [1, 7.5, 2])
    assert isinstance(state.rotation, quaternion.quaternion)
    want = quat_from_angle_axis(1.1, (0.2, 0.9, -0.4))
    assert abs((state.rotation * want.inverse()).w) == pytest.approx(1, abs=1e-6)
    sensor = state.sensor_states["color_sensor"]
    up = quaternion.rotate_vectors(want, [0, 1.5, 0])
    assert np.allclose(sensor.position, state.position + up, atol=1e-5)
    # The camera looks straight down from 7.5 m: the floor is a plane at a constant depth.
    place(sim, [0, 6.0, 0], -math.pi / 2, (1, 0, 0))
    down = sim.get_sensor_observations()["depth_sensor"]
    assert np.allclose(down[12:20, 20:28], 6.0 - 0.07, atol=2e-3)


def test_rotations_are_set_as_xyzw_lists(sim):
    agent, half = sim.get_agent(0), math.sin(math.pi / 4)
    state = agent.get_state()
    state.position, state.rotation = [0, 0.07, 0], [0, half, 0, half]  # A quarter turn to the left: along -x.
    state.sensor_states = {}
    agent.set_state(state, True)
    sim.step("move_forward")
    assert np.allclose(agent.get_state().position, [-0.25, 0.07, 0], atol=1e-5)
    state.position = [float("nan"), 0, 0]
    with pytest.raises(ValueError, match="not finite"):
        agent.set_state(state)


def test_actions_move_by_their_amounts_and_walls_collide(sim):
    agent = place(sim, [0, 0.07, 0])
    for action, count, position, degrees in (
        ("move_forward", 4, [0, 0.07, -1], 0),
        ("turn_left", 9, [0, 0.07, -1], 90),
    ):
        for _ in range(count):
            assert sim.step(action)["collided"] is False
        state = agent.get_state()
        assert np.allclose(state.position, position, atol=1e-4)
        assert math.degrees(2 * math.atan2(state.rotation.y, state.rotation.w)) == pytest.approx(degrees, abs=1e-3)
    place(sim, [0, 0.07, NORTH_WALL + 0.5])
    hits = [sim.step("move_forward")["collided"] for _ in range(3)]
    assert hits == [False, True, True]
    low = min(v.z for v in sim.pathfinder.build_navmesh_vertices())
    assert agent.get_state().position[2] == pytest.approx(low, abs=1e-4)
    with pytest.raises(AssertionError, match="fly"):
        sim.step("fly")


def test_sensors_can_be_turned_and_placed_anywhere(sim):
    agent = place(sim, [0, 0.07, 0])
    node = sim.agents[0].sensors["depth_sensor"].node
    node.rotation = node.rotation * mn.Quaternion.rotation(mn.Deg(-90), mn.Vector3.x_axis())
    assert np.allclose(sim.get_sensor_observations()["depth_sensor"][10:20, 20:28], 1.5, atol=1e-3)
    agent.set_state(agent.get_state(), reset_sensors=True)
    sim.add_sensor(camera("extra", DEPTH, position=[0, 0, 0]))
    state = agent.get_state()
    state.sensor_states["extra"] = habitat_sim.SixDOFPose([0, 1, -2], quat_from_angle_axis(math.pi, [0, 1, 0]))
    agent.set_state(state, infer_sensor_states=False)
    sensor = sim.get_sensor("extra")
    sensor.draw_observation()
    assert np.allclose(sensor.get_observation()[16, 24], 3.0 + 2.0, atol=2e-3)  # To the inner wall at z = 3.
    with pytest.raises(ValueError, match="extra"):
        sim.add_sensor(camera("extra", DEPTH))
    sim.remove_sensor("extra")
    with pytest.raises(KeyError):
        sim.remove_sensor("extra")


def test_cameras_of_more_than_180_degrees(stage):
    agent = habitat_sim.AgentConfiguration(
        sensor_specifications=[
            camera("sphere", DEPTH, habitat_sim.EquirectangularSensorSpec, resolution=[64, 128]),
            camera(
                "fish",
                COLOR,
                habitat_sim.FisheyeSensorDoubleSphereSpec,
                focal_length=[20, 20],
                principal_point_offset=None,
            ),
        ]
    )
    config = habitat_sim.SimulatorConfiguration()
    config.scene_id = stage
    with habitat_sim.Simulator(habitat_sim.Configuration(config, [agent])) as sim:
        place(sim, [0, 0.07, 0])
        seen = sim.get_sensor_observations()
        assert seen["fish"].shape == (32, 48, 4)
        # The middle looks ahead, the last row down. Depth is the distance along the ray.
        assert seen["sphere"][31:33, 63:65].mean() == pytest.approx(4.4, rel=2e-3)
        assert seen["sphere"][63].mean() == pytest.approx(1.5, rel=2e-3)


def test_the_clock_advances_twice_per_action(sim, monkeypatch):
    sim.reset()
    start = sim.get_world_time()
    sim.step("turn_left")
    assert sim.get_world_time() - start == pytest.approx(1 / 60)
    sim.step_physics(1 / 60)
    assert sim.get_world_time() - start == pytest.approx(2 / 60)
    monkeypatch.setenv("GSNAV_ACTION_SECONDS", "0.25")
    sim.step("turn_left")
    sim.step_physics(1 / 60)
    assert sim.get_world_time() - start == pytest.approx(0.25 + 2 / 60)
    monkeypatch.setenv("GSNAV_ACTION_SECONDS", "-1")
    with pytest.raises(ValueError, match="GSNAV_ACTION_SECONDS = -1"):
        sim.step("turn_left")


def test_reset_and_reconfigure(sim, pack):
    first = sim.get_agent(0).initial_state
    sim.step("move_forward")
    sim.reset()
    assert np.allclose(sim.get_agent(0).get_state().position, first.position)
    config = make_cfg({"scene": str(pack / "data/scene_datasets/habitat-test-scenes/apartment_1.glb")})
    area = sim.pathfinder.navigable_area
    sim.close(destroy=False)
    sim.reconfigure(config)
    assert sim.pathfinder.navigable_area > area and "color_sensor" in sim.step("move_forward")


@pytest.mark.parametrize("dt", [math.nan, math.inf, -1.0])
def test_times_out_of_range_change_nothing(sim, dt):
    before, pose = sim.get_world_time(), sim.get_agent(0).get_state()
    for call in (lambda: sim.step("move_forward", dt), lambda: sim.step_physics(dt), lambda: sim.step_world(dt)):
        with pytest.raises(ValueError, match=f"dt = {dt}"):
            call()
    assert sim.get_world_time() == before and sim.gaussian_time == 0.0 and sim.get_agent(0).get_state() == pose


@pytest.mark.parametrize("fields", [{"amount": math.nan}, {"amount": mn.Deg(math.inf)},
                                    {"amount": 0.25, "constraint": math.nan}])  # fmt: skip
def test_actuations_that_are_not_finite_change_nothing(stage, fields):
    config = make_cfg({"scene": stage, "width": 16, "height": 16})
    config.agents.append(make_cfg({"width": 16, "height": 16}).agents[0])
    config.agents[1].action_space["odd"] = habitat_sim.ActionSpec("turn_left", habitat_sim.ActuationSpec(**fields))
    with habitat_sim.Simulator(config) as sim:
        poses = [agent.get_state() for agent in sim.agents]
        name = "amount" if len(fields) == 1 else "constraint"
        for call in (lambda: sim.step({0: "move_forward", 1: "odd"}), lambda: sim.get_agent(1).act("odd")):
            with pytest.raises(ValueError, match=f"ActuationSpec.{name} = .*(nan|inf)"):
                call()
        assert [agent.get_state() for agent in sim.agents] == poses and sim.get_world_time() == 0.0


def test_two_agents(stage):
    config = make_cfg({"scene": stage, "width": 16, "height": 16})
    config.agents.append(make_cfg({"width": 16, "height": 16}).agents[0])
    with habitat_sim.Simulator(config) as sim:
        before = [sim.get_agent(i).get_state().position for i in (0, 1)]
        seen = sim.step({1: "move_forward"})
        assert list(seen) == [1] and "color_sensor" in seen[1]
        assert np.array_equal(sim.get_agent(0).get_state().position, before[0])
        assert not np.array_equal(sim.get_agent(1).get_state().position, before[1])


def test_an_empty_scene_and_one_that_does_not_exist():
    with habitat_sim.Simulator(make_cfg({"scene": "NONE", "depth_sensor": True, "width": 8, "height": 6})) as sim:
        seen = sim.step("move_forward")
        assert not seen["depth_sensor"].any() and seen["color_sensor"].shape == (6, 8, 4) and not seen["collided"]
        assert sim.semantic_scene is None and sim.get_object_template_manager().load_configs("x") == []
    with pytest.raises(FileNotFoundError, match="no_such_scene.glb"):
        habitat_sim.Simulator(make_cfg({"scene": "no_such_scene.glb"}))


@pytest.mark.parametrize("fields", [
    {"sensor_subtype": habitat_sim.SensorSubType.ORTHOGRAPHIC}, {"sensor_type": habitat_sim.SensorType.NORMAL},
    {"noise_model": "NoSuchNoise"}, {"gpu2gpu_transfer": True},
])  # fmt: skip
def test_sensors_that_are_not_served_say_so(stage, fields):
    config = make_cfg({"scene": stage})
    config.agents[0].sensor_specifications = [camera("odd", COLOR, **fields)]
    with pytest.raises(NotImplementedError, match="gsnav.*'odd'"):
        habitat_sim.Simulator(config)


def test_names_that_are_not_served_say_so(sim):
    for call in (habitat_sim.physics.RigidObjectManager, habitat_sim.ReplayRenderer, habitat_sim.gfx.DebugLineRender,
                 habitat_sim._ext.habitat_sim_bindings.Configuration, lambda: sim.get_rigid_object_manager(),
                 lambda: sim.cast_ray()):  # fmt: skip
        with pytest.raises(NotImplementedError, match="gsnav serves navigation only: habitat_sim"):
            call()
    assert habitat_sim.__gsnav__ is True
    for where, name in ((habitat_sim, "no_such_name"), (habitat_sim.gfx, "no_such_name"), (mn, "no_such_name"),
                        (habitat_sim.AssetType, "GAUSSIAN_SPLATTING"), (habitat_sim.gfx.RenderTarget, "blit_depth_to"),
                        (habitat_sim.physics.MotionType, "DYNAMIC"), (habitat_sim.nav, "no_such_name"),
                        (habitat_sim.utils.common, "no_such_name"), (habitat_sim.agent.controls, "no_such_name"),
                        (habitat_sim.utils.settings, "no_such_name"), (mn.math, "no_such_name")):  # fmt: skip
        with pytest.raises(NotImplementedError, match=f"gsnav serves navigation only: .*{name}"):
            getattr(where, name)
        assert not hasattr(where, name)
    for name in ("navmesh_visualization", "frustum_culling", "renderer", "gfx_replay_manager", "set_object_bb_draw",
                 "get_runtime_perf_stat_names", "get_runtime_perf_stat_values", "get_rigid_constraint_settings",
                 "get_physics_simulation_library", "get_active_semantic_scene_graph", "cast_ray", "no_such_name",
                 "update_gaussian_avatar_pose"):  # fmt: skip
        with pytest.raises(NotImplementedError, match=f"gsnav serves navigation only: habitat_sim.Simulator.{name}$"):
            getattr(sim, name)
        assert not hasattr(sim, name)
    with pytest.raises(NotImplementedError, match="gsnav.*RenderInstanceHelper"):
        habitat_sim.RenderInstanceHelper(sim, use_xyzw_orientations=False)
    with pytest.raises(ImportError):
        from habitat_sim import no_such_name  # noqa: F401
    assert (habitat_sim.cuda_enabled, habitat_sim.built_with_bullet, habitat_sim.audio_enabled) == (False,) * 3


def test_velocity_control_moves_along_the_heading_and_turns():
    control = habitat_sim.physics.VelocityControl()
    control.controlling_lin_vel = control.controlling_ang_vel = True
    control.lin_vel_is_local = control.ang_vel_is_local = True
    control.linear_velocity, control.angular_velocity = np.array([0, 0, -2.0]), [0, math.pi / 2, 0]
    quarter = mn.Quaternion.rotation(mn.Deg(90), mn.Vector3.y_axis())
    after = control.integrate_transform(0.5, habitat_sim.RigidState(quarter, np.array([1.0, 2, 3])))
    assert after.translation == [0, 2, 3]
    assert after.rotation == mn.Quaternion.rotation(mn.Deg(135), mn.Vector3.y_axis())


def run_python(code, **environment):
    folder = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    path = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, **environment}
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)


def test_import_starts_no_thread_loads_no_library_and_says_once_what_it_is():
    code = (
        "import os, sys, habitat_sim, magnum, corrade; "
        "print(len(os.listdir('/proc/self/task')), 'gsnav' in sys.modules, 'quaternion' in sys.modules)"
    )
    environment = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    clean = {k: v for k, v in os.environ.items() if k != "GSNAV_HABITAT_NOTICE"}
    os.environ.pop("GSNAV_HABITAT_NOTICE", None)
    try:
        result = run_python(code, **environment)
    finally:
        os.environ.update(clean)
    assert result.stdout.split() == ["1", "False", "False"], result.stderr
    assert result.stderr.count("Not affiliated with Meta") == 1


# The import may load these besides numpy: modules of the standard library, most of them for dataclasses.
LIGHT = {"array", "colorsys", "copy", "dataclasses", "enum", "functools", "logging", "random", "threading", "typing",
         "warnings", "weakref", "inspect", "ast", "dis", "opcode", "tokenize", "token", "linecache", "importlib",
         "string", "textwrap", "traceback", "atexit", "time", "keyword"}  # fmt: skip


def test_import_is_light():
    """Worker processes import habitat_sim anew, so its import must not load what only some calls need."""
    code = (
        "import numpy, numpy.random, random, sys; before = set(sys.modules); import habitat_sim, magnum, corrade; "
        "print(*{name.partition('.')[0] for name in set(sys.modules) - before})"
    )
    result = run_python(code, GSNAV_HABITAT_NOTICE="0")
    heavy = {name for name in result.stdout.split() if not name.startswith("_")} - LIGHT
    assert heavy == {"habitat_sim", "magnum", "corrade", "gsnav_habitat"}, result.stderr


@pytest.mark.parametrize("name", ["habitat_sim-0.3.4", "magnum-20.0.0", "magnum_bindings-1.0"])
def test_import_refuses_beside_another_distribution(tmp_path, name):
    (tmp_path / f"{name}.dist-info").mkdir()
    (tmp_path / f"{name}.dist-info" / "METADATA").write_text(f"Name: {name.split('-')[0]}\n")
    result = run_python(f"import sys; sys.path.append({str(tmp_path)!r}); import habitat_sim")
    assert "ImportError" in result.stderr and "gsnav-habitat" in result.stderr
    assert name.split("-")[0].replace("_", "-") in result.stderr


@pytest.mark.parametrize("entry, name", [
    ("habitat-sim.egg-link", "habitat-sim"), ("habitat_sim.egg-info", "habitat-sim"),
    ("habitat_sim-0.3.3-py3.12-linux-x86_64.egg", "habitat-sim 0.3.3"),
])  # fmt: skip
def test_import_refuses_beside_the_forms_that_setuptools_installs(tmp_path, entry, name):
    (tmp_path / entry).write_text("")
    result = run_python(f"import sys; sys.path.append({str(tmp_path)!r}); import habitat_sim")
    assert f"and {name} both" in result.stderr and "ImportError: The distributions gsnav-habitat" in result.stderr


@pytest.mark.parametrize("package, importing, place", [  # 0 is before this distribution.
    ("magnum", "habitat_sim", 0), ("corrade", "habitat_sim", 0), ("habitat_sim", "magnum", 0),
    ("magnum", "habitat_sim", 99), ("corrade", "habitat_sim", 99), ("habitat_sim", "magnum", 99),
    ("habitat_sim", "habitat_sim", 99),
])  # fmt: skip
def test_import_refuses_beside_a_package_without_metadata(tmp_path, package, importing, place):
    (tmp_path / package).mkdir()
    (tmp_path / package / "__init__.py").write_text("")
    result = run_python(f"import sys; sys.path.insert({place}, {str(tmp_path)!r}); import {importing}")
    assert "ImportError: The distributions gsnav-habitat" in result.stderr
    assert package.replace("_", "-") in result.stderr and str(tmp_path / package) in result.stderr


def test_a_second_copy_of_this_distribution_is_no_other_one(tmp_path):
    for package in ("habitat_sim", "gsnav_habitat"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("")
    result = run_python(f"import sys; sys.path += [{str(tmp_path)!r}, b'bytes']; import habitat_sim")
    assert result.returncode == 0, result.stderr


def test_the_distribution_has_the_version_of_the_library():
    root = pathlib.Path(__file__).resolve().parents[3]
    header = (root / "include/gsnav/version.hpp").read_text()
    numbers = re.findall(r"VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header)
    text = (root / "bindings/habitat/pyproject.toml").read_text()
    assert f'version = "{".".join(numbers)}"' in text
