# SPDX-License-Identifier: Apache-2.0
"""Arrays are shared with other libraries without a copy, and arrays of other libraries are taken."""

import gc
import itertools
import warnings

import numpy as np
import pytest

import gsnav


class OnlyDlpack:
    """An array that is seen through DLPack only."""

    def __init__(self, array):
        self.array = np.asarray(array)

    def __dlpack__(self, **kwargs):
        return self.array.__dlpack__(**kwargs)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def library(name):
    """A function that makes an array of a library, which may be absent."""
    if name == "numpy":
        return np.asarray
    if name == "dlpack":
        return OnlyDlpack
    if name == "torch":
        return pytest.importorskip("torch").from_numpy
    jax = pytest.importorskip("jax")
    return lambda values: jax.device_put(values, jax.devices("cpu")[0])


LIBRARIES = pytest.mark.parametrize("name", ["numpy", "dlpack", "torch", "jax"])


def address(array):
    return array.__array_interface__["data"][0]


@pytest.fixture()
def envs(people, small):
    return gsnav.VectorEnv(3, people, config=small)


def test_observations_share_their_memory_with_torch(envs):
    torch = pytest.importorskip("torch")
    image = envs.reset(seed=1)[0]["rgb"]
    for tensor in (torch.from_dlpack(image), torch.from_numpy(image)):
        assert tensor.data_ptr() == address(image) and tensor.shape == image.shape
        tensor[0, 0, 0, 0] = 7
        assert image[0, 0, 0, 0] == 7


def test_observations_share_their_memory_with_jax(envs):
    library("jax")
    import jax

    kept = envs.reset(seed=1)[0]
    arrays = {name: jax.dlpack.from_dlpack(kept[name]) for name in ("rgb", "depth")}
    for name, array in arrays.items():
        assert array.unsafe_buffer_pointer() == address(kept[name]), name
    pixels = kept["rgb"].copy()
    del kept
    for i in range(4):
        envs.step([1, 2, 3])
    assert np.array_equal(arrays["rgb"], pixels)


def test_observations_are_aligned_and_may_be_changed(envs, people, small):
    views = gsnav.VectorEnv(3, people, config=small, copy=False)
    views.reset(seed=1)
    envs.reset(seed=1)
    for i in range(30):
        actions = [(i + e) % 3 + 1 for e in range(3)]
        ours, theirs = envs.step(actions)[0], views.step(actions)[0]
        for name in ("rgb", "depth"):
            assert np.array_equal(ours[name], theirs[name])
            assert address(ours[name]) % 64 == 0 and ours[name].flags.writeable and ours[name].flags.c_contiguous
            ours[name][...] = -1  # the next images do not depend on it
    mask = np.array([False, True, False])
    ours, theirs = (e.reset(seed=5, options={"reset_mask": mask})[0] for e in (envs, views))
    assert np.array_equal(ours["rgb"], theirs["rgb"])


def test_images_are_aligned(opened, people, small):
    camera = gsnav.framing_camera(opened, 30, 22)
    episode = gsnav.generate_episodes(people.navmesh, 1, 1)[0]
    renderer, simulator, env = gsnav.Renderer("cpu", opened), gsnav.Simulator("cpu", people, small), gsnav.Env(people)
    outputs = int(gsnav.Output.kRgb | gsnav.Output.kAlpha | gsnav.Output.kMedianDepth)
    renderer.set_config(gsnav.RenderConfig(outputs=outputs))
    simulator.reset(episode)
    frames = [renderer.render(camera), renderer.render([camera, camera]), simulator.render(camera, outputs)]
    kept = [f.rgb.copy() for f in frames]
    images = [getattr(f, name) for f in frames for name in ("rgb", "alpha", "median_depth")]
    images += [image for name, image in env.reset(seed=1)[0].items() if name != "point_goal"]
    assert all(address(image) % 64 == 0 and image.flags.writeable for image in images)
    images[0][...] = -1
    assert np.array_equal(renderer.render(camera).rgb, kept[0])
    assert np.array_equal(frames[1].rgb, kept[1]) and np.array_equal(frames[2].rgb, kept[2])


def test_images_of_a_renderer_share_their_memory_with_jax(opened):
    library("jax")
    import jax

    rgb = gsnav.Renderer("cpu", opened).render(gsnav.framing_camera(opened, 30, 22)).rgb
    assert jax.dlpack.from_dlpack(rgb).unsafe_buffer_pointer() == address(rgb)


def unaligned(values):
    """A copy at an odd address."""
    values = np.asarray(values)
    made = np.zeros(values.nbytes + 1, np.uint8)[1:].view(values.dtype).reshape(values.shape)
    made[...] = values
    assert not made.flags.aligned
    return made


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.int64, np.uint64])
def test_unaligned_actions(people, small, envs, kind):
    own = gsnav.VectorEnv(3, people, config=small)
    own.reset(seed=1), envs.reset(seed=1)
    actions = np.array([1, 2, 3], kind)
    assert np.array_equal(envs.step(unaligned(actions))[0]["rgb"], own.step(actions)[0]["rgb"])
    ours, theirs = (e.simulator.step(a)["rgb"] for e, a in ((envs, unaligned(actions)), (own, actions)))
    assert np.array_equal(ours, theirs)


def test_actions_in_the_order_of_another_machine_are_named(envs):
    envs.reset(seed=1)
    for call in (envs.step, envs.simulator.step):
        with pytest.raises(TypeError, match="got ndarray of dtype >i4"):
            call(np.array([1, 2, 3], ">i4"))


def test_unaligned_positions_and_images(square):
    for kind in (np.float32, np.float64):
        ends = [unaligned(np.array(p, kind)) for p in ([1, 0, 1], [2, 0, 1])]
        assert square.find_path(*ends).length == 1
        vertices = np.array([[0, 0, 0], [9, 0, 0], [9, 0, 9]], kind)
        for index in (np.int32, np.uint32):
            triangles = np.array([[0, 2, 1]], index)
            meshes = [gsnav.NavMesh.build(gsnav.NavMeshSettings(), wrap(vertices), wrap(triangles))
                      for wrap in (np.asarray, unaligned)]
            assert meshes[0].island_area(0) == meshes[1].island_area(0)
    with pytest.raises(ValueError, match="to_bytes: the array is not aligned"):
        gsnav.to_bytes(unaligned(np.zeros((2, 2, 3), np.float32)))


def test_memory_of_dead_observations_is_used_again_within_a_bound(envs):
    step = [1, 2, 3]
    one = sum(envs.reset(seed=1)[0][name].nbytes for name in ("rgb", "depth"))
    seen = {address(envs.step(step)[0]["rgb"]) for _ in range(10)}
    assert len(seen) <= 2
    held = [envs.step(step)[0] for _ in range(6)]
    assert len({address(o["rgb"]) for o in held}) == 6
    kept = [o["rgb"].copy() for o in held]
    for _ in range(5):
        envs.step(step)
    assert all(np.array_equal(o["rgb"], k) for o, k in zip(held, kept))
    part = held[0]["rgb"][1:, ::2]
    del held
    assert envs.simulator.unused_bytes == 2 * one
    envs.step(step)
    assert np.array_equal(part, kept[0][1:, ::2])
    simulator = envs.simulator
    envs.close()
    assert simulator.unused_bytes == 2 * one
    del simulator, envs
    gc.collect()
    assert np.array_equal(part, kept[0][1:, ::2])


def test_sensors_that_share_an_image_have_arrays_of_their_own(people):
    sensors = [*gsnav.rgbd_sensors(8, 8), gsnav.SensorSpec(uuid="again", resolution=[8, 8], position=(0, 1.5, 0))]
    envs = gsnav.VectorEnv(2, people, config=gsnav.SimulatorConfig(sensors=sensors))
    seen = envs.reset(seed=1)[0]
    assert np.array_equal(seen["rgb"], seen["again"]) and address(seen["rgb"]) != address(seen["again"])


@pytest.mark.parametrize("mode", [gsnav.AutoReset.next_step, gsnav.AutoReset.disabled])
def test_new_arrays_are_deleted_in_every_order(people, small, mode):
    episodes = gsnav.generate_episodes(people.navmesh, 2, 1)
    config = gsnav.BatchConfig(sensors=small.sensors, auto_reset=mode)
    for order in itertools.permutations(range(5)):
        batch = gsnav.BatchSimulator("serial", [people], config, 2, lambda e, k: episodes[e], copy=True)
        first, second = batch.reset(), batch.step([1, 2])
        things = [batch, first, first["rgb"], second["depth"][1:], second]
        kept = [None, None, first["rgb"].copy(), second["depth"][1:].copy(), None]
        del batch, first, second
        for i in order:
            things[i] = None
            gc.collect(0)
            if things[0] is not None:
                things[0].reset()
            assert all(things[j] is None or np.array_equal(things[j], kept[j]) for j in (2, 3))
            assert things[4] is None or np.array_equal(things[4]["depth"][1:], kept[3])


@LIBRARIES
def test_actions_of_other_libraries(people, small, envs, name):
    make = library(name)
    own = gsnav.VectorEnv(3, people, config=small)
    env, single = gsnav.Env(people, config=small), gsnav.Env(people, config=small)
    env.reset(seed=1), single.reset(seed=1), envs.reset(seed=1), own.reset(seed=1)
    episodes = gsnav.generate_episodes(people.navmesh, 3, 1)
    batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=[]), 3, lambda e, k: episodes[e])
    batch.reset()
    for kind in (np.int32, np.uint8):
        actions = np.array([1, 2, 3], kind)
        assert np.array_equal(envs.step(make(actions))[0]["rgb"], own.step(actions)[0]["rgb"])
        assert np.array_equal(env.step(make(np.array(2, kind)))[0]["rgb"], single.step(2)[0]["rgb"])
        assert np.array_equal(env.simulator.step(make(np.array(1, kind)))["rgb"], single.simulator.step(1)["rgb"])
        assert len(batch.step(make(actions)).rewards) == 3
    wrong = make(np.ones(3, np.float32))
    for call in (envs.step, batch.step, env.step):
        with pytest.raises((TypeError, ValueError), match="action"):
            call(wrong)
    with pytest.raises(gsnav.InvalidArgument, match="environment 1: action 9"):
        envs.step(make(np.array([1, 9, 1], np.int32)))
    with pytest.raises(TypeError, match="expected an Action"):
        env.simulator.step(wrong)
    if name != "dlpack":
        mask = make(np.array([True, False, True]))
        assert envs.reset(seed=1, options={"reset_mask": mask})[0]["rgb"].shape == (3, 16, 24, 3)


@LIBRARIES
def test_poses_of_other_libraries(people, small, square, name):
    make = library(name)
    episode = gsnav.generate_episodes(people.navmesh, 1, 1)[0]
    simulator = gsnav.Simulator("cpu", people, small)
    start = episode.start_position
    for kind in (np.float32, np.float64):
        if name == "jax" and kind == np.float64:
            continue
        episode.start_position = make(start.astype(kind))
        assert np.allclose(episode.start_position, start, atol=1e-6)
        simulator.reset(episode)
        simulator.set_agent(make(start.astype(kind)), 0.5)
        assert abs(simulator.agent.yaw - 0.5) < 1e-12
        camera = gsnav.Camera(width=6, height=4, fx=3.0, fy=3.0)
        camera.viewmat = [make(row) for row in np.eye(4, dtype=kind)]
        assert np.array_equal(camera.viewmat, np.eye(4))
        assert square.find_path(make(np.array([1, 0, 1], kind)), make(np.array([2, 0, 1], kind))).length == 1
    for wrong in (np.zeros(2, np.float32), np.zeros((3, 1), np.float32), np.zeros(3, np.complex64)):
        with pytest.raises(TypeError):
            simulator.set_agent(make(wrong), 0.0)
    vertices, triangles = [[0, 0, 0], [9, 0, 0], [9, 0, 9]], [[0, 2, 1]]
    mesh = gsnav.NavMesh.build(gsnav.NavMeshSettings(), make(np.array(vertices, np.float32)),
                               make(np.array(triangles, np.int32)))
    assert mesh.island_area(0) > 10


def test_objects_without_init_are_refused():
    """Each method and property of an object that __new__ made is an exception with words."""
    for name, kind in sorted(vars(gsnav._gsnav).items()):
        if not isinstance(kind, type) or issubclass(kind, (int, Exception)) or "gsnav" not in kind.__module__:
            continue
        try:
            made = kind.__new__(kind)
        except TypeError:
            continue
        for member in vars(kind):
            static = type(vars(kind)[member]).__name__ == "nb_func"
            if static or member.startswith("__") and member not in ("__getitem__", "__repr__", "__getstate__"):
                continue
            with pytest.raises(Exception) as caught, warnings.catch_warnings():
                warnings.simplefilter("ignore")  # nanobind's own
                value = getattr(made, member)
                value(*{"step": [1], "world": [0], "scene_of": [0], "__getitem__": ["x"]}.get(member, []))
            assert isinstance(caught.value, (TypeError, gsnav.Error)), (name, member, caught.value)
            assert "bad_cast" not in str(caught.value) and str(caught.value), (name, member)


@pytest.mark.parametrize("date", [np.datetime64(1, "s"), np.timedelta64(1, "s")])
def test_dates_of_numpy_are_refused(people, small, envs, date):
    """Their buffers have no strides, which nanobind follows."""
    envs.reset(seed=1)
    camera = gsnav.Camera()
    episodes = gsnav.generate_episodes(people.navmesh, 3, 1)
    batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=small.sensors), 3,
                                 lambda e, k: episodes[e], image_source=lambda sensor, floats: date)
    calls = [lambda: gsnav.Camera.look_at(date, (0, 0, 0), (0, 1, 0), 4, 4, 90), lambda: envs.step(date),
             lambda: setattr(camera, "viewmat", np.full(3, date)), lambda: envs.simulator.step(date),
             lambda: envs.simulator.reset(date), lambda: gsnav.to_bytes(date), lambda: batch.reset(),
             lambda: gsnav.with_noise(gsnav.NoiseModel(), 1, date)]
    for call in calls:
        with pytest.raises((TypeError, ValueError)):
            call()


COMPLEX = [1 + 2j, np.complex64(1 + 2j), np.complex128(1 + 2j), np.array(1 + 2j, np.complex64), np.array([1 + 2j])]


@pytest.mark.parametrize("number", COMPLEX, ids=lambda x: f"{type(x).__name__}-{getattr(x, 'dtype', '')}")
def test_complex_numbers_are_no_floats(people, square, number):
    """numpy would drop the imaginary part, with a warning that most programs do not show."""
    camera, task, quality = gsnav.Camera(), gsnav.TaskConfig(), gsnav.Quality()
    for call in (lambda: setattr(camera, "fx", number), lambda: setattr(task, "max_steps", number),
                 lambda: gsnav.TaskConfig(agent_radius=number), lambda: setattr(quality, "alpha_min", number),
                 lambda: gsnav.Aabb(low=[0, number, 0]), lambda: gsnav.SnapOptions(half_extents=(1, 1, number)),
                 lambda: gsnav.FisheyeLens(focal_length=[number, 1]), lambda: gsnav.SensorSpec(hfov=number),
                 lambda: square.find_path([0, 0, number], [1, 0, 1]), lambda: gsnav.rgbd_sensors(8, 8, number),
                 lambda: gsnav.navmesh_viewpoints(square, [number], 1.0),
                 lambda: gsnav.default_simulator_scene(density=number)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with pytest.raises(TypeError):
                call()
    with pytest.raises(TypeError, match=r"Camera.fx: expected float, got .*2"):
        camera.fx = number
    camera.fx = np.float32(0.5)
    task.agent_radius, camera.fy = np.array(0.25), np.int16(7)
    assert (camera.fx, camera.fy, task.agent_radius) == (0.5, 7.0, 0.25)
