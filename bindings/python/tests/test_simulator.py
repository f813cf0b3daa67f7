# SPDX-License-Identifier: Apache-2.0
import copy
import gc
import math
import pickle

import numpy as np
import pytest

import gsnav


@pytest.fixture()
def episodes(people):
    return gsnav.generate_episodes(people.navmesh, 8, 1)


def test_follower_reaches_the_goal(people, episodes):
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8))
    simulator = gsnav.Simulator("cpu", people, config)
    follower = gsnav.GeodesicFollower()
    metrics = []
    for episode in episodes[:3]:
        observations = simulator.reset(episode)
        assert observations["rgb"].shape == (8, 8, 3) and observations["depth"].shape == (8, 8, 1)
        while not simulator.done:
            observations = simulator.step(follower.next(simulator.world))
        metrics.append(simulator.metrics())
        assert metrics[-1].success and metrics[-1].start_distance == pytest.approx(episode.geodesic_distance)
    assert gsnav.summarize(metrics).success_rate == 1


def test_batch_has_the_bits_of_single_simulators(people, episodes, small):
    count = 4
    settings = gsnav.BatchConfig(sensors=small.sensors, task=small.task)
    batch = gsnav.BatchSimulator("cpu", [people], settings, count, lambda e, k: episodes[(e + k) % 8])
    singles = [gsnav.Simulator("serial", people, small) for _ in range(count)]
    step = batch.reset()
    seen = [s.reset(episodes[e]) for e, s in enumerate(singles)]
    rng = np.random.default_rng(1)
    for i in range(12):
        for e in range(count):
            for name in ("rgb", "depth"):
                assert np.array_equal(step[name][e], seen[e][name]), (i, e, name)
            assert tuple(step.point_goals[e]) == (seen[e].point_goal.distance, seen[e].point_goal.angle)
            assert step.rewards[e] == seen[e].reward and step.infos["moved"][e] == seen[e].info.moved
            assert step.times[e] == seen[e].time
            assert not step.terminated[e] and not step.truncated[e]
        actions = rng.integers(1, 4, count)
        step = batch.step(actions)
        seen = [s.step(int(a)) for s, a in zip(singles, actions)]
    assert list(step.finished) == [0, 1, 2, 3] and step.truncated.all()
    for e, single in enumerate(singles):
        metrics = single.metrics()
        for name in step.final_metrics.dtype.names:
            assert step.final_metrics[name][e] == getattr(metrics, name), name


def test_steps_that_are_timed_without_python_are_the_same_steps(people, episodes, small):
    settings = gsnav.BatchConfig(sensors=small.sensors, task=small.task)
    timed, stepped = (gsnav.BatchSimulator("cpu", [people], settings, 2, lambda e, k: episodes[e]) for _ in range(2))
    actions = [np.array([1, 2]), np.array([3, 1]), np.array([2, 1])]
    timed.reset(), stepped.reset()
    assert timed._time_steps(actions[:2]) > 0
    for a in actions[:2]:
        stepped.step(a)
    got, expected = timed.step(actions[2]), stepped.step(actions[2])
    assert all(np.array_equal(got[name], expected[name]) for name in ("rgb", "depth"))
    with pytest.raises(gsnav.InvalidArgument, match="_time_steps: needs one step"):
        timed._time_steps([])
    copies = gsnav.BatchSimulator("cpu", [people], settings, 2, lambda e, k: episodes[e], copy=True)
    copies.reset()
    with pytest.raises(gsnav.InvalidArgument, match="copy = False"):
        copies._time_steps(actions)


def test_views_outlive_their_simulator(people, episodes, small):
    for order in range(6):
        simulator = gsnav.Simulator("cpu", people, small)
        batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=small.sensors), 2,
                                     lambda e, k: episodes[k])
        things = {"observations": simulator.reset(episodes[0]), "step": batch.reset(), "world": simulator.world,
                  "worlds": batch.world(1), "simulator": simulator, "batch": batch}
        arrays = [things["observations"]["rgb"], things["step"]["depth"], things["step"].infos["moved"],
                  things["step"].rewards, things["step"].truncated]
        kept = [a.copy() for a in arrays]
        del simulator, batch
        names = list(things)
        for name in names[order:] + names[:order]:
            del things[name]
            gc.collect()
            assert all(np.array_equal(a, b) for a, b in zip(arrays, kept))
            assert not any(a.flags.writeable for a in arrays)
            if "world" in things:
                assert things["world"].episode.id == "0"
            if "worlds" in things:
                assert math.isfinite(things["worlds"].distance_to_goal)


def test_a_cycle_through_the_episode_source_is_collected(people, episodes, small):
    import weakref

    class Owner:
        def __init__(self):
            self.batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=[]), 1, self.next)

        def next(self, environment, count):
            return episodes[count]

    owner = Owner()
    owner.batch.reset()
    gone = weakref.ref(owner)
    del owner
    gc.collect()
    assert gone() is None


def test_state_returns_to_a_moment(people, episodes, small):
    simulator = gsnav.Simulator("cpu", people, small)
    simulator.reset(episodes[0])
    simulator.step(gsnav.Action.move_forward)
    state = simulator.state()
    first = simulator.step(2)["rgb"].copy()
    simulator.step(1)
    simulator.set_state(state)
    assert state.steps == 1 and np.array_equal(simulator.step(2)["rgb"], first)


def test_other_cameras(people, episodes, small):
    simulator = gsnav.Simulator("cpu", people, small)
    simulator.reset(episodes[0])
    camera = gsnav.Camera.look_at((5, 2.5, 4), (5, 0, 4), (0, 0, -1), 20, 10, 90)
    frames = simulator.render(camera, gsnav.Output.kRgb | gsnav.Output.kMedianDepth)
    assert frames.rgb.shape == (10, 20, 3) and frames.median_depth.shape == (10, 20)
    with pytest.raises(gsnav.InvalidArgument):
        simulator.render(gsnav.Camera(width=-1))


def test_wrong_calls_leave_the_simulator_usable(people, episodes, small):
    simulator = gsnav.Simulator("cpu", people, small)
    with pytest.raises(gsnav.InvalidArgument, match="before reset"):
        simulator.step(1)
    simulator.reset(episodes[0])
    for action, error in [(6, gsnav.InvalidArgument), (-1, gsnav.InvalidArgument), (2**70, gsnav.InvalidArgument),
                          (1.0, TypeError), ("forward", TypeError), (None, TypeError)]:
        with pytest.raises(error, match="Simulator.step"):
            simulator.step(action)
    with pytest.raises(gsnav.InvalidArgument, match="finite"):
        simulator.step(gsnav.VelocityCommand(linear=math.nan))
    with pytest.raises(gsnav.InvalidArgument, match="finite"):
        simulator.set_agent((math.nan, 0, 0), 0)
    with pytest.raises(gsnav.NothingNavigable):
        simulator.set_agent((500, 0, 0), 0)
    with pytest.raises(TypeError):
        simulator.set_agent((1, 2), 0)
    with pytest.raises(KeyError, match="rgb"):
        simulator.observe()["thermal"]
    assert simulator.step(gsnav.VelocityCommand(linear=0.5)).info.moved > 0
    wrong = copy.copy(episodes[0])
    wrong.start_position = (500, 0, 0)
    with pytest.raises(gsnav.NothingNavigable, match="start_position"):
        simulator.reset(wrong)
    simulator.reset(episodes[1])
    simulator.step(0)
    with pytest.raises(gsnav.InvalidArgument, match="after the end"):
        simulator.step(1)


@pytest.mark.parametrize("actions, error, words", [
    ([1, 2], ValueError, "2 actions for 3 environments"), (np.ones(4, int), ValueError, r"\(4\)"),
    (np.ones((3, 1), int), ValueError, "shape"), (np.ones(3), TypeError, "integers"),
    (np.array([1, 6, 1]), gsnav.InvalidArgument, "environment 1: action 6"),
    (np.array([1, 1, -1], np.int8), gsnav.InvalidArgument, "environment 2: action -1"),
    ([1, 2, "x"], TypeError, "environment 2"), (7, TypeError, "array"), ("123", TypeError, "array"),
    ([gsnav.VelocityCommand()] * 2 + [gsnav.VelocityCommand(angular=math.inf)], ValueError, "environment 2"),
    ([gsnav.VelocityCommand(), 1, 1], TypeError, "velocities"),
])
def test_wrong_actions_move_no_environment(people, episodes, small, actions, error, words):
    settings = gsnav.BatchConfig(sensors=small.sensors)
    batch = gsnav.BatchSimulator("cpu", [people], settings, 3, lambda e, k: episodes[e])
    with pytest.raises(gsnav.InvalidArgument, match="reset"):
        batch.step([1, 1, 1])
    with pytest.raises(gsnav.InvalidArgument, match="reset"):
        batch.world(0)
    batch.reset()
    with pytest.raises(error, match=words):
        batch.step(actions)
    spread = np.full(6, 99, np.int16)
    spread[::2] = 1
    step = batch.step(spread[::2])
    assert [batch.world(e).state().steps for e in range(3)] == [1, 1, 1] and step.images["rgb"].shape[0] == 3
    with pytest.raises(IndexError):
        batch.world(3)


def test_errors_of_the_episode_source(people, episodes):
    answers = {"episode": None}

    def source(environment, count):
        if isinstance(answers["episode"], Exception):
            raise answers["episode"]
        return answers["episode"]

    batch = gsnav.BatchSimulator("cpu", [people], gsnav.BatchConfig(sensors=[]), 2, source)
    with pytest.raises(gsnav.InvalidArgument, match="returned NoneType"):
        batch.reset()
    answers["episode"] = KeyError("mine")
    with pytest.raises(KeyError, match="mine"):
        batch.reset()
    answers["episode"] = gsnav.BatchEpisode(scene=3, episode=episodes[0])
    with pytest.raises(gsnav.InvalidArgument, match="scene 3 of 1"):
        batch.reset()
    answers["episode"] = episodes[0]
    batch.reset()
    answers["episode"] = ValueError("later")
    batch.step([0, 1])
    with pytest.raises(ValueError, match="later"):
        batch.step([0, 1])
    answers["episode"] = episodes[0]
    assert batch.reset().rewards.shape == (2,)


def test_settings_can_be_copied_and_pickled():
    config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(4, 6), auto_reset=gsnav.AutoReset.same_step,
                               task=gsnav.TaskConfig(reward=gsnav.RewardConfig(success=7.0)))
    for again in (copy.deepcopy(config), pickle.loads(pickle.dumps(config))):
        assert repr(again) == repr(config) and again.sensors[0].resolution == [4, 6]
    config.task.max_steps = 3
    assert config.task.max_steps == 3
    with pytest.raises(TypeError, match="no field \"steps\""):
        gsnav.TaskConfig(steps=3)
    with pytest.raises(TypeError, match="TaskConfig.max_steps: expected int, got 'x'"):
        gsnav.TaskConfig(max_steps="x")
    with pytest.raises(TypeError, match="TaskConfig.max_steps: expected int, got 'x'"):
        config.task.max_steps = "x"
    for wrong in ([0, 0], np.zeros(3, complex), "abc", None):
        with pytest.raises(TypeError, match="PointNavEpisode.start_position: expected"):
            gsnav.PointNavEpisode().start_position = wrong
    episode = gsnav.PointNavEpisode(start_position=[1, 2, 3])
    episode.start_rotation = np.array([0, 0, 1, 0], np.float32)
    assert episode.start_rotation.tolist() == [0, 0, 1, 0] and config.task.max_steps == 3
    sensor = config.sensors[0]
    config.sensors = gsnav.rgbd_sensors(8, 8) * 3
    assert sensor.resolution == [4, 6] and sensor.uuid == "rgb"  # a list that was read is a copy
    config.sensors[0].uuid = "other"
    assert config.sensors[0].uuid == "rgb"
    device = gsnav.Device.parse("cpu:2")
    assert pickle.loads(pickle.dumps(device)) == device and device.threads == 2 and device != "cpu:2"


def test_wrong_settings_name_the_field(people):
    for config, words in [(gsnav.SimulatorConfig(task=gsnav.TaskConfig(max_steps=-1)), "max_steps"),
                          (gsnav.SimulatorConfig(sensors=[gsnav.SensorSpec(hfov=math.nan)]), "hfov"),
                          (gsnav.SimulatorConfig(sensors=[gsnav.SensorSpec()] * 2), "rgb")]:
        with pytest.raises(gsnav.InvalidArgument, match=words):
            gsnav.Simulator("cpu", people, config)
    for name in ("gpu", "", "best:1"):
        with pytest.raises(gsnav.InvalidArgument, match="serial"):
            gsnav.Simulator(name, people)
    if not any(name.startswith("cuda") for name in gsnav.Device.available()):
        with pytest.raises(gsnav.Unsupported):
            gsnav.Device.parse("cuda:0")
    with pytest.raises(FileNotFoundError, match="nowhere.ply"):
        gsnav.open_scene("nowhere.ply")


def test_episode_files(people, episodes, tmp_path):
    gsnav.io.save_episodes(tmp_path / "e.json.gz", episodes)
    again, warnings = gsnav.io.load_episodes(tmp_path / "e.json.gz")
    assert [repr(e) for e in again] == [repr(e) for e in episodes] and warnings == []
