# SPDX-License-Identifier: Apache-2.0
import copy
import pickle

import numpy as np
import pytest

import gsnav

gymnasium = pytest.importorskip("gymnasium")
AutoresetMode = gymnasium.vector.AutoresetMode


@pytest.fixture()
def env(people, small):
    return gsnav.Env(people, config=small, render_mode="rgb_array")


@pytest.fixture()
def envs(people, small):
    return gsnav.VectorEnv(3, people, config=small, render_mode="rgb_array")


def same(a, b):
    """Whether two observations or infos have the same keys and bits."""
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, np.ndarray) and a.dtype == object:
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if a is None or b is None:
        return a is b
    return np.asarray(a).dtype == np.asarray(b).dtype and np.array_equal(a, b)


def test_check_env(people, small):
    from gymnasium.utils.env_checker import check_env

    env = gymnasium.make("gsnav/PointNav-v0", scene=people, config=small, render_mode="rgb_array")
    check_env(env.unwrapped)  # warnings are errors (pyproject.toml)
    env.close()
    check_env(gsnav.Env(people, config=small))
    check_env(gsnav.Env(people, config=gsnav.SimulatorConfig(sensors=small.sensors[1:], task=small.task)))


def test_make_vec(people, small):
    envs = gymnasium.make_vec("gsnav/PointNav-v0", num_envs=4, scene=people, config=small)
    assert isinstance(envs, gsnav.VectorEnv) and isinstance(envs, gymnasium.vector.VectorEnv)
    observations, infos = envs.reset(seed=1)
    assert observations in envs.observation_space and observations["rgb"].shape == (4, 16, 24, 3)
    envs.action_space.seed(1)
    for _ in range(30):
        observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
        assert observations in envs.observation_space
    assert rewards.dtype == np.float64 and terminated.dtype == truncated.dtype == np.bool_
    envs.close()
    assert envs.closed


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_equal_to_gymnasiums_own_vector_of_single_environments(people, small, mode):
    envs = gsnav.VectorEnv(3, people, config=small, autoreset_mode=mode)
    own = gymnasium.vector.SyncVectorEnv([lambda: gsnav.Env(people, config=small)] * 3, autoreset_mode=mode)
    assert envs.single_observation_space == own.single_observation_space
    assert envs.observation_space == own.observation_space and envs.action_space == own.action_space
    assert envs.metadata["autoreset_mode"] == mode
    assert all(same(a, b) for a, b in zip(envs.reset(seed=5), own.reset(seed=5)))
    rng = np.random.default_rng(2)
    ends = 0
    for i in range(40):
        actions = rng.choice(4, 3, p=[0.1, 0.5, 0.2, 0.2])
        ours, theirs = envs.step(actions), own.step(actions)
        for name, a, b in zip(("observations", "rewards", "terminated", "truncated", "infos"), ours, theirs):
            assert same(a, b), (i, name)
        done = ours[2] | ours[3]
        ends += done.sum()
        if mode == AutoresetMode.DISABLED and done.any():
            with pytest.raises(gsnav.InvalidArgument, match="reset it first"):
                envs.step(actions)
            ours = envs.reset(options={"reset_mask": done.copy()})
            theirs = own.reset(options={"reset_mask": done.copy()})
            assert all(same(a, b) for a, b in zip(ours, theirs))
    assert ends > 5


def test_the_same_seed_gives_the_same_bits(envs):
    first, _ = envs.reset(seed=3)
    envs.step(np.ones(3, int))
    again, _ = envs.reset(seed=[3, 4, 5])
    other, _ = envs.reset(seed=4)
    assert same(first, again) and not same(first, other)
    assert np.array_equal(other["depth"][0], first["depth"][1])
    assert envs.np_random_seed == 4


def test_copies_and_views(people, small):
    envs = gsnav.VectorEnv(2, people, config=small)
    a, _ = envs.reset(seed=1)
    kept = a["rgb"].copy()
    b = envs.step(np.array([1, 2]))[0]
    assert np.array_equal(a["rgb"], kept) and not np.array_equal(b["rgb"], kept) and a["rgb"].flags.writeable
    views = gsnav.VectorEnv(2, people, config=small, copy=False)
    c, _ = views.reset(seed=1)
    d = views.step(np.array([1, 2]))[0]
    assert c["rgb"].__array_interface__["data"] == d["rgb"].__array_interface__["data"]
    assert np.array_equal(d["rgb"], b["rgb"]) and not d["rgb"].flags.writeable
    views.close()
    del views, envs
    assert np.array_equal(d["rgb"], b["rgb"])


def test_render(env, envs):
    with pytest.raises(gsnav.InvalidArgument, match="reset"):
        env.render()
    observation, _ = env.reset(seed=1)
    image = env.render()
    assert image.dtype == np.uint8 and image.shape == (16, 24, 3)
    assert np.abs(image / 255 - np.clip(observation["rgb"], 0, 1)).max() <= 0.5 / 255 + 1e-6
    envs.reset(seed=1)
    assert len(envs.render()) == 3 and np.array_equal(envs.render()[0], image)


@pytest.mark.parametrize("copy, mode", [(True, "NextStep"), (True, "Disabled"), (False, "NextStep")])
def test_render_shows_what_was_drawn(people, small, env, copy, mode):
    """Callers own what they are given. Changing it does not change what `render` shows."""
    envs = gsnav.VectorEnv(2, people, config=small, render_mode="rgb_array", copy=copy, autoreset_mode=mode)
    for one, action in ((env, 2), (envs, [2, 2])):
        for observation in (one.reset(seed=1)[0], one.step(action)[0]):
            shown = np.array(one.render())
            assert shown.any()
            for image in observation.values():
                if image.flags.writeable:
                    image[...] = 0
            observation.clear()
            assert np.array_equal(one.render(), shown)
            one.render()[0][...] = 0
            assert np.array_equal(one.render(), shown)


def test_environments_do_not_share_what_the_caller_may_change(people, small):
    episode = gsnav.BatchEpisode(episode=gsnav.generate_episodes(people.navmesh, 1, 7)[0])
    rules = gsnav.EpisodeRules(min_distance=2.0)
    config = gsnav.SimulatorConfig(**small.__getstate__())
    env = gsnav.Env(people, config=config, episodes=[episode])
    sampled = gsnav.Env(people, config=config, rules=rules)
    own = gsnav.Env(people, config=small, rules=gsnav.EpisodeRules(min_distance=2.0))
    episode.episode.id, rules.min_distance, config.task.max_steps = "mine", 4.0, 1
    env.reset(seed=1)
    assert env.simulator.world.episode.id == "0" and not env.step(1)[3]
    assert same(sampled.reset(seed=1)[0], own.reset(seed=1)[0])


def test_the_spec_makes_the_environment_again(people, small):
    config = gsnav.SimulatorConfig(**small.__getstate__())
    episodes = gsnav.generate_episodes(people.navmesh, 3, 7)
    named = gsnav.Env("default", config=config, episodes=episodes, device=gsnav.Device.parse("serial"))
    for env, spec in [(named, pickle.loads(pickle.dumps(named.spec))), (named, copy.deepcopy(named.spec))]:
        again = gymnasium.make(spec).unwrapped
        assert same(env.reset(seed=3)[0], again.reset(seed=3)[0]) and again.simulator.device.name == "serial"
        assert again.simulator.world.episode.id == env.simulator.world.episode.id
    objects = gsnav.Env(people, config=config, rules=gsnav.EpisodeRules(min_distance=3.0))
    again = gymnasium.make(objects.spec).unwrapped
    assert again.scene is people and same(objects.reset(seed=3)[0], again.reset(seed=3)[0])
    config.task.max_steps, config.sensors = 1, []
    assert named.spec.kwargs["config"].task.max_steps == small.task.max_steps
    assert len(objects.spec.kwargs["config"].sensors) == 2


def test_given_episodes_and_several_scenes(people, opened, small):
    episodes = gsnav.generate_episodes(people.navmesh, 3, 7)
    env = gsnav.Env(people, config=small, episodes=episodes)
    env.reset(seed=1, options={"episode": episodes[2]})
    assert env.simulator.world.episode.id == "2"
    with pytest.raises(gsnav.InvalidArgument, match="action"):
        env.step(9)
    envs = gsnav.VectorEnv(6, [people, opened], config=small)
    envs.reset(seed=1)
    assert {envs.simulator.scene_of(e) for e in range(6)} == {0, 1}


def test_wrappers(people, small):
    from gymnasium.wrappers import vector

    envs = vector.RecordEpisodeStatistics(gsnav.VectorEnv(2, people, config=small))
    envs = vector.ClipReward(envs, -1, 1)
    envs.reset(seed=1)
    for _ in range(14):
        infos = envs.step(np.array([1, 2]))[4]
        if "episode" in infos:
            break
    assert infos["episode"]["l"].max() == 12
