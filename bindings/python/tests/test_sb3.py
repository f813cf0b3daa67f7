# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

import gsnav

stable_baselines3 = pytest.importorskip("stable_baselines3")
import gsnav.sb3  # noqa: E402

CONFIG = dict(config=gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8), task=gsnav.TaskConfig(max_steps=30)))


def learn(envs, steps):
    torch = pytest.importorskip("torch")
    torch.set_num_threads(1)
    model = stable_baselines3.PPO("MultiInputPolicy", envs, n_steps=256 // getattr(envs, "num_envs", 1),
                                  batch_size=64, n_epochs=1, seed=1, device="cpu")
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(2048)
    assert model.num_timesteps == 2048
    assert any(not torch.equal(a, b) for a, b in zip(before, model.policy.parameters()))
    assert all(torch.isfinite(p).all() for p in model.policy.parameters())
    assert len(model.ep_info_buffer) > 20 and all(0 < e["l"] <= 30 for e in model.ep_info_buffer)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")
def test_ppo_runs_2048_steps(people):
    learn(gsnav.Env(people, **CONFIG), 2048)
    learn(gsnav.sb3.VecEnv(gsnav.VectorEnv(8, people, autoreset_mode="SameStep", **CONFIG)), 2048)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")
def test_the_lines_of_the_guide(people):
    pytest.importorskip("torch").set_num_threads(1)
    config, scene = CONFIG["config"], people
    # [snippet: ppo]
    import gsnav.sb3
    import stable_baselines3

    envs = gsnav.sb3.VecEnv(gsnav.VectorEnv(16, scene, config=config, autoreset_mode="SameStep"))
    model = stable_baselines3.PPO("MultiInputPolicy", envs, n_steps=128).learn(2048)
    # [/snippet]
    assert model.num_timesteps == 2048


def test_vec_env_has_the_episodes_of_the_vector_env(people):
    own = gsnav.VectorEnv(3, people, autoreset_mode="SameStep", **CONFIG)
    envs = gsnav.sb3.VecEnv(gsnav.VectorEnv(3, people, autoreset_mode="SameStep", **CONFIG))
    assert envs.seed(4) == [4, 5, 6]
    assert np.array_equal(envs.reset()["rgb"], own.reset(seed=4)[0]["rgb"])
    rng = np.random.default_rng(1)
    total, steps, ends = np.zeros(3), np.zeros(3, int), 0
    for _ in range(70):
        actions = rng.choice(4, 3, p=[0.05, 0.55, 0.2, 0.2])
        ours, theirs = envs.step(actions), own.step(actions)
        dones = theirs[2] | theirs[3]
        assert np.array_equal(ours[0]["depth"], theirs[0]["depth"]) and np.array_equal(ours[2], dones)
        assert ours[1].dtype == np.float32 and np.array_equal(ours[1], theirs[1].astype(np.float32))
        total, steps = total + theirs[1], steps + 1
        for e, info in enumerate(ours[3]):
            assert ("terminal_observation" in info) == dones[e]
            if dones[e]:
                assert np.array_equal(info["terminal_observation"]["rgb"], theirs[4]["final_obs"][e]["rgb"])
                assert info["TimeLimit.truncated"] == theirs[3][e]
                assert info["episode"] == {"r": total[e], "l": steps[e]}
                assert info["metrics"]["steps"] == theirs[4]["final_info"]["metrics"]["steps"][e]
                total[e], steps[e], ends = 0, 0, ends + 1
            else:
                assert info["moved"] == theirs[4]["moved"][e]
    assert ends > 5
    envs.close()
    with pytest.raises(gsnav.InvalidArgument, match="SameStep"):
        gsnav.sb3.VecEnv(gsnav.VectorEnv(2, people, **CONFIG))
