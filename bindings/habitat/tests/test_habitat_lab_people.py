# SPDX-License-Identifier: Apache-2.0
"""What gsnav adds to habitat-lab: measures of people and environments in one process. Skipped without habitat-lab."""

import importlib.util
import pathlib

import pytest

for _name in ("habitat", "gsnav"):
    if importlib.util.find_spec(_name) is None:
        pytest.skip(f"{_name} is not installed", allow_module_level=True)
from test_habitat_lab import overrides_of, run_module  # noqa: E402

pytestmark = pytest.mark.filterwarnings("default")
SMALL = [
    f"habitat.simulator.agents.main_agent.sim_sensors.{s}_sensor.{k}=16"
    for s in ("rgb", "depth")
    for k in ("width", "height")
]
# As on a GPU, but drawn on the CPU. Only the process of the trainer runs this.
TOGETHER = """
import runpy, sys
from habitat_sim import _draw

if __name__ == "__main__":
    usual, sizes = _draw.Painter._draw_places, []
    def counted(self, group, seconds, places):
        sizes.append(len(places))
        return usual(self, group, seconds, places)
    _draw._together, _draw.Painter._draw_places = lambda device: True, counted
    sys.argv = sys.argv[1:]
    runpy.run_path(sys.argv[0], run_name="__main__")
    assert max(sizes) == 2  # A quarter of five, rounded up.
    print("calls for many:", sizes.count(2))
"""


def need_baselines():
    for name in ("torch", "habitat_baselines"):
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"{name} is not installed")


def test_measures_and_reward_are_those_of_the_simulator(pack, monkeypatch):
    import gsnav
    import habitat
    from gsnav.habitat import avatar_pointnav_config
    from habitat.gym import make_gym_from_config

    monkeypatch.setenv("GSNAV_PEOPLE", "3")
    monkeypatch.setenv("GSNAV_ACTION_SECONDS", "0.25")
    config = habitat.get_config(avatar_pointnav_config(), overrides=[*overrides_of(pack), *SMALL])
    env = make_gym_from_config(config)
    sim = env.unwrapped.habitat_env.sim
    weights = gsnav.TaskConfig.avatar_pointnav().reward
    env.reset()
    before, intrusions, hits = env.unwrapped.habitat_env.get_metrics()["distance_to_goal"], [], []
    for i in range(40):
        _, reward, _, info = env.step(1 if i % 4 else 2)
        gap, hit = sim.avatar_step()
        hits.append(hit)
        intrusions.append(min(max(1 - gap, 0), 1))
        want = before - info["distance_to_goal"] - weights.proximity * intrusions[-1] - weights.collision * hit
        before = info["distance_to_goal"]
        assert info["avatar_navigation_reward"] == pytest.approx(want, abs=1e-9)
        assert reward == pytest.approx(want + config.habitat.task.slack_reward, abs=1e-9)
        assert info["collision_rate"] == pytest.approx(sum(hits) / (i + 1))
        # The mean over three people is at least a third of that of the nearest.
        mean = sum(intrusions) / (i + 1)
        assert mean / 3 - 1e-9 <= info["personal_space_intrusion"] <= mean + 1e-9
        assert info["human_collision"] in (0.0, 1.0)
    assert env.reset() is not None and sim.avatar_metrics().steps == 0
    env.close()


def test_after_an_error_in_an_environment_close_frees_environments_and_threads(pack, caplog):
    need_baselines()
    import threading
    import time

    from gsnav.habitat import BatchVectorEnvFactory
    from habitat_baselines.config.default import get_config

    settings = [*overrides_of(pack), "habitat_baselines.num_environments=2", *SMALL]
    config = get_config("pointnav/ppo_pointnav_example.yaml", settings)
    before = set(threading.enumerate())
    for actions in ([99, 1], [1, 99], [98, 99]):
        with pytest.raises(AssertionError, match="Invalid action 9"):  # That of the environment, not of close.
            with BatchVectorEnvFactory().construct_envs(config) as envs:
                envs.reset()
                envs.step(actions)
        assert all(worker._env is None for worker in envs._everyone)
        envs.close()
    assert caplog.text.count("unread: AssertionError('Invalid action 99") == 1  # The second of two.
    deadline = time.monotonic() + 10
    while set(threading.enumerate()) - before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert set(threading.enumerate()) - before == set()


# Ends while environments are open and the result of a step is not read.
LEFT_OPEN = """
import sys
from gsnav.habitat import BatchVectorEnvFactory
from habitat_baselines.config.default import get_config

envs = BatchVectorEnvFactory().construct_envs(get_config("pointnav/ppo_pointnav_example.yaml", sys.argv[1:]))
envs.reset()
envs.async_step_at(0, 1)
"""


def test_a_program_that_is_interrupted_ends_quietly(pack, tmp_path):
    need_baselines()
    (tmp_path / "interrupted.py").write_text(LEFT_OPEN + "raise KeyboardInterrupt")
    arguments = [*overrides_of(pack), "habitat_baselines.num_environments=2", *SMALL]
    with pytest.raises(AssertionError) as failed:  # The status of a program after Ctrl-C is not 0.
        run_module(["interrupted.py", *arguments], tmp_path)
    text = str(failed.value)
    assert "KeyboardInterrupt" in text and "Exception ignored" not in text


def test_a_program_that_leaves_environments_open_ends_quietly(pack, tmp_path):
    need_baselines()
    (tmp_path / "left_open.py").write_text(LEFT_OPEN)
    arguments = [*overrides_of(pack), "habitat_baselines.num_environments=2", *SMALL]
    text = run_module(["left_open.py", *arguments], tmp_path)
    assert "Exception ignored" not in text and "Traceback" not in text


def test_one_process_gives_the_bits_of_forkserver_workers(pack, tmp_path):
    need_baselines()
    script = str(pathlib.Path(__file__).parent / "compare_vector_envs.py")
    text = run_module([script, "40", *overrides_of(pack), "habitat_baselines.num_environments=2", *SMALL], tmp_path)
    assert "episodes agree" in text and "bits agree" in text


def test_images_of_environments_in_one_call_have_the_bits_of_forkserver_workers(pack, tmp_path):
    need_baselines()
    script = str(pathlib.Path(__file__).parent / "compare_vector_envs.py")
    (tmp_path / "together.py").write_text(TOGETHER)
    text = run_module(
        ["together.py", script, "30", *overrides_of(pack), "habitat_baselines.num_environments=5", *SMALL], tmp_path
    )
    assert "episodes agree" in text and "bits agree" in text
    calls = int(text.split("calls for many: ")[1].split()[0])
    assert calls >= 30
