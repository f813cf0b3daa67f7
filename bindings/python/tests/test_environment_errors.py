# SPDX-License-Identifier: Apache-2.0
"""Wrong arguments of environments. An error names them, and the environments stay as they are."""

import math
import os
import time

import numpy as np
import pytest
from test_environments import env, envs, same  # noqa: F401

import gsnav

gymnasium = pytest.importorskip("gymnasium")


@pytest.mark.parametrize("actions, error", [
    ([1, 2], ValueError), ([[1], [2], [3]], ValueError), ([1.0, 2.0, 3.0], TypeError), ([1, 4, 1], ValueError),
    ([1, -1, 1], ValueError), (["a", "b", "c"], TypeError), (None, TypeError), ([True] * 3, TypeError),
    ([1, 1, True], TypeError), ((1, np.True_, 2), TypeError), (np.array([1, 2, 3], np.complex64), TypeError),
    ([math.nan] * 3, TypeError),
])
def test_wrong_actions(envs, actions, error):
    envs.reset(seed=1)
    with pytest.raises(error, match="VectorEnv.step"):
        envs.step(actions)
    assert [envs.simulator.world(e).state().steps for e in range(3)] == [0, 0, 0]
    assert envs.step([1, 2, 3])[0]["rgb"].shape == (3, 16, 24, 3)


def test_a_bool_is_no_action(env):
    env.reset(seed=1)
    for wrong in (True, np.bool_(True)):
        with pytest.raises(gsnav.InvalidArgument, match="Env.step: action"):
            env.step(wrong)
    assert env.simulator.world.state().steps == 0


def test_a_bool_is_no_action_of_a_simulator(env, envs):
    env.reset(seed=1), envs.reset(seed=1)
    for wrong in (True, np.True_, np.array(True)):
        for call in (lambda: env.simulator.step(wrong), lambda: envs.simulator.step([1, 1, wrong])):
            with pytest.raises(TypeError, match="expected an Action or an integer, got "):
                call()
    assert env.simulator.world.state().steps == envs.simulator.world(0).state().steps == 0


def test_wrong_resets(envs):
    envs.reset(seed=1)
    for mask, error in [([True, False, False], TypeError), (np.ones(3), TypeError), (np.ones(2, bool), ValueError),
                        (np.zeros(3, bool), ValueError)]:
        with pytest.raises(error, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})
    with pytest.raises(ValueError, match="2 seeds for 3"):
        envs.reset(seed=[1, 2])
    before = [g.bit_generator.state for g in envs._source.generators]
    with pytest.raises((ValueError, gymnasium.error.Error), match="-3"):
        envs.reset(seed=[1, -3, 2])
    assert [g.bit_generator.state for g in envs._source.generators] == before
    assert envs.step([1, 1, 1])[1].shape == (3,)


def off_the_mesh(episode):
    """The episode with a start that is on no NavMesh."""
    return gsnav.PointNavEpisode(**{**episode.__getstate__(), "start_position": (1000.0, 0.0, 0.0)})


@pytest.mark.parametrize("arguments, error", [
    ({"seed": 5, "options": {"episode": 3}}, TypeError), ({"seed": 5, "options": {"episode": "lost"}}, ValueError),
    ({"seed": 5, "options": 5}, TypeError), ({"seed": -1}, ValueError), ({"seed": True}, TypeError),
    ({"seed": 1.5}, TypeError), ({"seed": "1"}, TypeError),
])
def test_a_refused_reset_changes_nothing(env, arguments, error):
    if arguments.get("options") == {"episode": "lost"}:
        arguments = {**arguments, "options": {"episode": off_the_mesh(gsnav.PointNavEpisode())}}
    with pytest.raises(error):
        env.reset(**arguments)
    env.reset(seed=3)
    env.step(1)
    kept, place = env.np_random.bit_generator.state, env.simulator.agent
    with pytest.raises(error, match="seed|option|episode"):
        env.reset(**arguments)
    assert env.np_random.bit_generator.state == kept and env.np_random_seed == 3
    assert repr(env.simulator.agent) == repr(place) and not env.simulator.done
    assert env.step(1)[0] in env.observation_space  # the episode goes on
    own = gsnav.Env(env.scene, config=env.simulator.config)
    own.reset(seed=3)
    assert same(env.reset()[0], own.reset()[0])  # the next episode is that of seed 3


def test_a_reset_whose_episode_fails_can_be_repeated(people, small):
    episodes = gsnav.generate_episodes(people.navmesh, 3, 7)
    env = gsnav.Env(people, config=small, episodes=[*episodes, off_the_mesh(episodes[0])])
    envs = gsnav.VectorEnv(3, people, config=small, episodes=[*episodes, off_the_mesh(episodes[0])])
    wrong = next(s for s in range(1, 100) if gsnav._spaces.make_generator(s)[0].integers(4) == 3)
    env.reset(seed=wrong - 1)
    generators = [env.np_random, *envs._source.generators]
    kept = [g.bit_generator.state for g in generators]
    for call in (lambda: env.reset(seed=wrong), lambda: envs.reset(seed=[0, wrong, wrong])):
        with pytest.raises(gsnav.NothingNavigable, match="start_position"):
            call()
    assert [g.bit_generator.state for g in generators] == kept and env.np_random_seed == wrong - 1
    assert [env.np_random, *envs._source.generators] == generators
    assert envs.np_random_seed not in (0, wrong)


def test_a_refused_reset_of_a_mask_changes_nothing(envs):
    envs.reset(seed=3)
    mask = np.array([True, False, False])
    for seed, words in [([1, 2, -3], r"seed\[2\] = -3"), ([1, True, 2], r"seed\[1\]"), ([-1, 2, 3], r"seed\[0\]"),
                        (True, "seed: expected"), (1.5, "seed: expected"), ("abc", "seed: expected"), (-2, "= -2")]:
        kept = [g.bit_generator.state for g in envs._source.generators]
        with pytest.raises((TypeError, ValueError), match=words):
            envs.reset(seed=seed, options={"reset_mask": mask})
        assert [g.bit_generator.state for g in envs._source.generators] == kept and envs.np_random_seed == 3
    with pytest.raises(TypeError, match="options: expected a dict"):
        envs.reset(seed=1, options=[mask])
    a, b = envs.reset(seed=np.int64(7)), envs.reset(seed=np.arange(7, 10))
    assert same(a[0], b[0])


def test_closed_environments(env, envs):
    observations, _ = envs.reset(seed=1)
    env.reset(seed=1)
    env.close(), env.close(), envs.close(), envs.close()
    for call in (env.reset, envs.reset, lambda: env.step(1), lambda: envs.step([1, 1, 1])):
        with pytest.raises(gsnav.ClosedEnvironment, match="closed"):
            call()
    assert observations["rgb"].any()


def test_wrong_arguments(people, small, square):
    with pytest.raises(ValueError, match="autoreset|valid"):
        gsnav.VectorEnv(2, people, config=small, autoreset_mode="sometimes")
    for change, words in [({"num_envs": 0}, "num_envs"), ({"render_mode": "human"}, "render_mode"),
                          ({"episodes": []}, "episodes")]:
        with pytest.raises(gsnav.InvalidArgument, match=words):
            gsnav.VectorEnv(**{"num_envs": 2, "scene": people, "config": small, **change})
    with pytest.raises(TypeError, match="scene"):
        gsnav.Env(7)
    for number in (3.7, "3", True, None):
        with pytest.raises(TypeError, match="num_envs: expected an integer"):
            gsnav.VectorEnv(number, people, config=small)
    with pytest.raises(gsnav.InvalidArgument, match="NavMesh"):
        gsnav.Env(gsnav.open_scene("default", gsnav.OpenOptions(density=0.05)))
    with pytest.raises(FileNotFoundError):
        gsnav.Env("nowhere.ply")


@pytest.mark.parametrize("argument, wrong, words", [
    ("config", {}, r"config: expected SimulatorConfig or None, got \{\}"), ("config", 5, "config: expected .* got 5"),
    ("rules", {}, r"rules: expected EpisodeRules or None, got \{\}"), ("rules", 0, "rules: expected .* got 0"),
    ("device", None, "device: expected Device or str, got None"),
    ("episodes", 5, "episodes: expected a sequence .* got 5"), ("episodes", {}, r"episodes: expected .* got \{\}"),
    ("episodes", "mine.json", "episodes: expected"), ("device", 5, "device: expected Device or str, got 5"),
    ("episodes", [7], r"episodes\[0\]: expected a PointNavEpisode or a BatchEpisode, got int"),
])
def test_an_argument_of_another_type_is_named(people, small, argument, wrong, words):
    arguments = {"config": small, argument: wrong}
    for make in (lambda: gsnav.Env(people, **arguments), lambda: gsnav.VectorEnv(2, people, **arguments)):
        with pytest.raises(TypeError, match=words):
            make()
    with pytest.raises(TypeError, match="copy: expected bool, got 'no'"):
        gsnav.VectorEnv(2, people, config=small, copy="no")


def test_a_bool_is_no_number_of_steps_and_no_seed():
    for owner, field in [(gsnav.TaskConfig(), "max_steps"), (gsnav.SimulatorConfig(), "seed"),
                         (gsnav.OpenOptions(), "seed")]:
        with pytest.raises(TypeError, match=f"{type(owner).__name__}.{field}: expected int, got True"):
            setattr(owner, field, True)
        with pytest.raises(TypeError, match=f"{type(owner).__name__}.{field}: expected int, got True"):
            type(owner)(**{field: True})
        setattr(owner, field, np.int64(7))
        assert getattr(owner, field) == 7


def test_depth_without_a_far_plane(people):
    sensors = gsnav.rgbd_sensors(16, 24)
    images = []
    for far in (1e6, math.inf):
        sensors[1].far_plane = far
        env = gsnav.Env(people, config=gsnav.SimulatorConfig(sensors=sensors))
        images.append(env.reset(seed=1)[0]["depth"])
        assert np.isfinite(env.observation_space["depth"].high).all() and images[-1] in env.observation_space["depth"]
    assert np.array_equal(*images) and images[0].any()
    for far in (math.nan, -math.inf, 0.0):
        sensors[1].far_plane = far
        with pytest.raises(gsnav.InvalidArgument, match='SensorSpec "depth": far_plane = '):
            gsnav.Env(people, config=gsnav.SimulatorConfig(sensors=sensors))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_settings_that_are_no_numbers_are_named(people, square, value):
    camera, cloud = gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 8, 8, 90), people.assets[0].cloud

    def playing(task):
        return gsnav.Env(people, config=gsnav.SimulatorConfig(task=task))

    for call, words in [
            (lambda: gsnav.Renderer("cpu", people).render(camera, value), "Renderer.render: time"),
            (lambda: gsnav.GreedyGeodesicFollower(square, (1, 0, 1)).next((2, 0, 2), value), "Follower.next: yaw"),
            (lambda: gsnav.GeodesicFollower(gsnav.FollowerOptions(comfort=value)), "FollowerOptions.comfort"),
            (lambda: playing(gsnav.TaskConfig(skin=value)), "TaskConfig.skin"),
            (lambda: playing(gsnav.TaskConfig(reward=gsnav.RewardConfig(slack=value))), "TaskConfig.reward"),
            (lambda: gsnav.build_visible_sets("cpu", cloud, [(5, 1.5, 4)], gsnav.VisibleSettings(cell=value)), "cell")]:
        with pytest.raises(gsnav.InvalidArgument, match=f"{words} = -?(nan|inf)"):
            call()
    if math.isnan(value):
        crop = gsnav.Aabb(low=(0, value, 0), high=(1, 1, 1))
        with pytest.raises(gsnav.InvalidArgument, match="OpenOptions.crop.low = nan"):
            gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", crop=crop))
        with pytest.raises(gsnav.InvalidArgument, match="max_distance = nan"):
            gsnav.generate_episodes(square, 1, 1, gsnav.EpisodeRules(max_distance=value))


@pytest.mark.parametrize("sides", [(2**15, 2**15), (2**30, 1), (0, 8)])
def test_sizes_that_no_sensor_can_have(people, sides):
    sensors = gsnav.rgbd_sensors(8, 8)
    sensors[1].resolution = sides
    wrong = next(side for side in sides if not 1 <= side <= 16384)
    config = gsnav.SimulatorConfig(sensors=sensors)
    for make in (sensors[1].validate, lambda: gsnav.Env(people, config=config),
                 lambda: gsnav.VectorEnv(2, people, config=config), lambda: gsnav.Simulator("cpu", people, config)):
        with pytest.raises(gsnav.InvalidArgument, match=f'SensorSpec "depth": resolution = {wrong}: '):
            make()


def test_odd_values_name_the_argument(people, small):
    for more, error, words in [({"autoreset_mode": "bad"}, gsnav.InvalidArgument, "autoreset_mode = 'bad': use one"),
                               ({"scene": []}, gsnav.InvalidArgument, "scene: the list is empty"),
                               ({"scene": "a\0b"}, gsnav.InvalidArgument, r"scene = 'a\\x00b'"),
                               ({"render_mode": np.array([1, 2])}, gsnav.InvalidArgument, "render_mode"),
                               ({"num_envs": 10**400}, gsnav.OutOfMemory, "environments")]:
        with pytest.raises(error, match=words):
            gsnav.VectorEnv(**{"num_envs": 2, "scene": people, "config": small, **more})
    envs = gsnav.VectorEnv(2, people, config=small)
    before = envs.reset(seed=3)[0]
    for seed in (np.array(5), {1, 2}, {1: 2, 3: 4}, 1.5, [1, 2.5]):
        with pytest.raises(TypeError, match="seed"):
            envs.reset(seed=seed)
    for actions, error in [([1, [2]], gsnav.InvalidArgument), (np.ma.array([1, 2], mask=[True, False]), TypeError)]:
        with pytest.raises(error, match="VectorEnv.step: actions"):
            envs.step(actions)
    for seed in (3, [3, 4], (3, 4), np.array([3, 4])):
        assert np.array_equal(envs.reset(seed=seed)[0]["rgb"], before["rgb"])


def test_spaces_without_memory_name_the_sensors(people, small):
    with pytest.raises(gsnav.OutOfMemory, match=r"2147483648 environments \('rgb': resolution = \[16, 24\]"):
        gsnav.VectorEnv(2**31, people, config=small)
    with pytest.raises(gsnav.OutOfMemory, match=r"1099511627776 environments \(no sensors\): "):
        gsnav.VectorEnv(2**40, people, config=gsnav.SimulatorConfig(sensors=[]))


@pytest.mark.parametrize("group, limits, expected", [
    ("0::/a/b", {"a/b/memory.max": "max", "a/memory.max": "5000000", "memory.max": "7000000"}, 5_000_000),
    ("0::/a/b", {"a/b/memory.max": "3000000", "a/memory.max": "5000000"}, 3_000_000),
    ("0::/of/the/host", {"memory.max": "4000000"}, 4_000_000),
    ("0::/../..", {"memory.max": "4000000"}, 4_000_000),
    ("5:cpu,memory:/docker/x\n0::/", {"memory/docker/x/memory.limit_in_bytes": "6000000"}, 6_000_000),
    ("5:memory:/docker/x", {"memory/memory.limit_in_bytes": "2000000", "memory.max": "1"}, 2_000_000),
    ("5:memory:/", {"memory/memory.limit_in_bytes": "9223372036854771712"}, None),
    ("4:cpu:/a", {"a/memory.max": "7"}, None), ("", {"memory.max": "7"}, None), ("no group", {}, None),
])
def test_limits_of_containers(people, small, tmp_path, monkeypatch, group, limits, expected):
    for name, text in limits.items():
        (tmp_path / "sys/fs/cgroup" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "sys/fs/cgroup" / name).write_text(text + "\n")
    assert gsnav._memory.limit(str(tmp_path)) == gsnav._memory.limit(str(tmp_path / "nowhere"))
    (tmp_path / "proc/self").mkdir(parents=True)
    (tmp_path / "proc/self/cgroup").write_text(group + "\n")
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    assert gsnav._memory.limit(str(tmp_path)) == (machine if expected is None else expected)
    if expected is not None:
        limit = gsnav._memory.limit
        monkeypatch.setattr(gsnav._memory, "limit", lambda: limit(str(tmp_path)))
        for config in (small, gsnav.SimulatorConfig(sensors=[])):
            with pytest.raises(gsnav.OutOfMemory, match=f"5000 environments .* GB of {expected / 1e9:.3g}$"):
                gsnav.VectorEnv(5000, people, config=config)


@pytest.mark.parametrize("config, gigabytes", [({}, "0.419"), ({"outputs": int(gsnav.Output.kMedianDepth)}, "0.0839")])
def test_images_of_a_renderer_fit_into_the_container(people, monkeypatch, config, gigabytes):
    camera = gsnav.Camera.look_at((5, 1.5, 4), (5, 1, 3), (0, 1, 0), 1024, 1024, 90)
    renderer = gsnav.Renderer("serial", people, gsnav.RenderOptions(render=gsnav.RenderConfig(**config)))
    monkeypatch.setattr(gsnav._memory, "limit", lambda: 80_000_000)
    start = time.process_time()
    with pytest.raises(gsnav.OutOfMemory, match=f"the images of 12 of 1024 x 1024 pixels: {gigabytes} GB of 0.08$"):
        renderer.render([camera] * 12)
    assert time.process_time() - start < 0.2  # before anything is rendered
    monkeypatch.setattr(gsnav._memory, "limit", lambda: 1 << 40)
    assert renderer.render([camera] * 2).median_depth.shape == (2, 1024, 1024)
    renderer.set_config(gsnav.RenderConfig(outputs=int(gsnav.Output.kAlpha)))
    monkeypatch.setattr(gsnav._memory, "limit", lambda: 80_000_000)
    assert renderer.render([camera] * 4).alpha.shape == (4, 1024, 1024)
