# SPDX-License-Identifier: Apache-2.0
"""habitat-lab, unmodified, on the stand-in pack. Skipped where habitat-lab is not installed."""

import importlib.util
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

if importlib.util.find_spec("habitat") is None or importlib.util.find_spec("gsnav") is None:
    pytest.skip("habitat-lab or gsnav is not installed", allow_module_level=True)
pytestmark = pytest.mark.filterwarnings("default")
POINTNAV = "benchmark/nav/pointnav/pointnav_habitat_test.yaml"


def overrides_of(pack):
    data = pack / "data"
    return [
        f"habitat.dataset.data_path={data}/datasets/pointnav/habitat-test-scenes/v1/val/val.json.gz",
        f"habitat.dataset.scenes_dir={data}/scene_datasets",
        "habitat.dataset.split=val",
    ]


def pointnav(pack, *more):
    import habitat

    size = [
        f"habitat.simulator.agents.main_agent.sim_sensors.{s}_sensor.{k}=32"
        for s in ("rgb", "depth")
        for k in ("width", "height")
    ]
    return habitat.get_config(POINTNAV, overrides=[*overrides_of(pack), *size, *more])


def test_the_follower_of_habitat_lab_solves_all_episodes_with_measures_and_map(pack):
    import habitat
    from habitat.config import read_write
    from habitat.config.default_structured_configs import CollisionsMeasurementConfig, TopDownMapMeasurementConfig
    from habitat.tasks.nav.shortest_path_follower import ShortestPathFollower
    from habitat.utils.visualizations.utils import observations_to_image

    config = pointnav(pack)
    with read_write(config):
        config.habitat.task.measurements.top_down_map = TopDownMapMeasurementConfig()
        config.habitat.task.measurements.collisions = CollisionsMeasurementConfig()
    with habitat.Env(config) as env:
        follower = ShortestPathFollower(env.sim, 0.15, return_one_hot=False)
        for _ in range(4):
            seen = env.reset()
            assert seen["rgb"].shape == (32, 32, 3) and seen["rgb"].dtype == np.uint8
            assert seen["depth"].shape == (32, 32, 1) and 0 <= seen["depth"].min() <= seen["depth"].max() <= 1
            episode = env.current_episode
            distance, bearing = seen["pointgoal_with_gps_compass"]
            straight = np.subtract(episode.goals[0].position, episode.start_position)
            assert distance == pytest.approx(np.linalg.norm(straight), rel=1e-4) and abs(bearing) <= np.pi
            start = env.get_metrics()
            assert start["distance_to_goal"] == pytest.approx(episode.info["geodesic_distance"], rel=1e-4)
            while not env.episode_over:
                seen = env.step(follower.get_next_action(episode.goals[0].position))
            end = env.get_metrics()
            assert end["success"] == 1 and end["spl"] > 0.9 and end["distance_to_goal"] < 0.2
            assert end["top_down_map"]["map"].any() and observations_to_image(seen, end).shape[2] == 3


def test_the_example_of_the_guide(pack):
    example = pathlib.Path(__file__).parents[3] / "examples/habitat/play_episode.py"
    assert "'success': 1.0" in run_module([example], pack)


def test_look_actions_tilt_the_cameras(pack):
    import habitat
    from habitat.config import read_write
    from habitat.config.default_structured_configs import LookDownActionConfig, LookUpActionConfig

    config = pointnav(pack)
    with read_write(config):
        config.habitat.task.actions.look_up = LookUpActionConfig()
        config.habitat.task.actions.look_down = LookDownActionConfig()
    with habitat.Env(config) as env:
        first = env.reset()["depth"]
        down = env.step("look_down")["depth"]
        assert down.mean() != first.mean() and np.array_equal(env.step("look_up")["depth"], first)


def test_image_goals(pack):
    import habitat

    with habitat.Env(
        habitat.get_config("benchmark/nav/imagenav/imagenav_test.yaml", overrides=overrides_of(pack))
    ) as env:
        seen = env.reset()
        assert seen["imagegoal"].shape == seen["rgb"].shape and seen["imagegoal"].any()


SCRIPT = """
import sys
import habitat, numpy as np
from habitat.core.vector_env import ThreadedVectorEnv, VectorEnv
from habitat.gym import make_gym_from_config

if __name__ == "__main__":
    config = habitat.get_config(sys.argv[1], overrides=sys.argv[2:])
    sums = []
    for kind in (ThreadedVectorEnv, VectorEnv):
        envs = kind(make_env_fn=make_gym_from_config, env_fn_args=[(config,)] * 2)
        first = envs.reset()
        for action in (2, 1, 1):
            rows = envs.step([action] * 2)
        sums.append([float(r[0]["depth"].astype(np.float64).sum()) for r in rows])
        envs.close()
    assert sums[0] == sums[1], sums
    print("both vector environments agree")
"""


def run_module(arguments, folder, **more):
    """Output of a program of Python in a folder. `more` are variables of its environment."""
    here = str(pathlib.Path(__file__).resolve().parents[1])
    path = os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1", **more}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stdout + done.stderr


def test_vector_environments_of_threads_and_of_forkserver_agree(pack, tmp_path):
    (tmp_path / "vector.py").write_text(SCRIPT)
    assert "both vector environments agree" in run_module(["vector.py", POINTNAV, *overrides_of(pack)], tmp_path)


def test_habitat_baselines_trains_three_updates(pack, tmp_path):
    for name in ("torch", "habitat_baselines"):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed")
    text = run_module(
        ["-m", "habitat_baselines.run", "--config-name=pointnav/ppo_pointnav_example.yaml", *overrides_of(pack),
         "habitat_baselines.num_environments=2", "habitat_baselines.total_num_steps=-1.0",
         "habitat_baselines.num_updates=3", "habitat_baselines.rl.ppo.num_steps=8",
         "habitat_baselines.num_checkpoints=1", "habitat_baselines.log_interval=1",
         f"habitat_baselines.checkpoint_folder={tmp_path}", f"habitat_baselines.tensorboard_dir={tmp_path}/tb"],
        tmp_path,
    )  # fmt: skip
    assert "Num updates: 3" in text and (tmp_path / "latest.pth").exists()
