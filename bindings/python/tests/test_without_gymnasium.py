# SPDX-License-Identifier: Apache-2.0
"""The environments have the same shape where Gymnasium is absent."""

import subprocess
import sys

PROGRAM = """
import sys
sys.modules["gymnasium"] = None  # importing it fails
import numpy as np
import gsnav
assert gsnav.VectorEnv.__mro__[1].__module__ == "gsnav._spaces"
scene = gsnav.default_simulator_scene(people=0, density=0.05)
config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(8, 8), task=gsnav.TaskConfig(max_steps=5))
envs = gsnav.VectorEnv(3, scene, config=config, autoreset_mode="SameStep")
observations, infos = envs.reset(seed=1)
assert observations in envs.observation_space
assert envs.single_observation_space["rgb"].shape == (8, 8, 3)
assert envs.action_space.sample() in envs.action_space
for _ in range(5):
    step = envs.step(np.array([1, 2, 3]))
assert step[3].all() and step[4]["final_obs"][0] in envs.single_observation_space
total = float(observations["rgb"][1].sum())
assert list(envs.observation_space) == [*envs.observation_space.keys()] and len(envs.observation_space.items()) == 3
assert envs.action_space == gsnav.VectorEnv(3, scene, config=config).action_space
assert envs.action_space != gsnav.VectorEnv(2, scene, config=config).action_space
assert envs.single_observation_space["depth"].is_bounded() and envs.single_action_space.start == 0
envs.close(), envs.close()
with gsnav.Env(scene, config=config) as env:
    assert env.get_wrapper_attr("render_mode") is None and env.has_wrapper_attr("step")
    env.np_random = np.random.default_rng(1)
env = gsnav.Env(scene, config=config)
observation, _ = env.reset(seed=2)
assert observation in env.observation_space and env.action_space.sample() in env.action_space
assert float(observation["rgb"].sum()) == total and env.np_random_seed == 2
print(total)
"""


def test_same_shape_and_same_episodes():
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    with_gymnasium = PROGRAM.replace("sys.modules", "{}").replace('"gsnav._spaces"', '"gymnasium.vector.vector_env"')
    again = subprocess.run([sys.executable, "-c", with_gymnasium], capture_output=True, text=True)
    assert again.returncode == 0, again.stderr
    assert run.stdout == again.stdout
