# SPDX-License-Identifier: Apache-2.0
"""habitat-baselines, unmodified, trains among people and in one process. Skipped where it is not installed."""

import importlib.util
import math
import pathlib
import re

import pytest

for _name in ("habitat", "habitat_baselines", "torch", "gsnav"):
    if importlib.util.find_spec(_name) is None:
        pytest.skip(f"{_name} is not installed", allow_module_level=True)
from test_habitat_lab import overrides_of, run_module  # noqa: E402

pytestmark = pytest.mark.filterwarnings("default")
CONFIGS = pathlib.Path(__file__).parents[1] / "gsnav_habitat" / "config"
FACTORY = "habitat_baselines.vector_env_factory._target_=gsnav.habitat.BatchVectorEnvFactory"
SIDE = 48  # The smallest image of the example's network is 36 pixels.
SMALL = [
    f"habitat.simulator.agents.main_agent.sim_sensors.{s}_sensor.{k}={SIDE}"
    for s in ("rgb", "depth")
    for k in ("width", "height")
]


def train(pack, folder, arguments, updates, steps, environments=2, **environment):
    """Log of a training, and the weights of its policy after the last update."""
    import torch

    text = run_module(
        ["-m", "habitat_baselines.run", *arguments, *overrides_of(pack), *SMALL,
         f"habitat_baselines.num_environments={environments}", "habitat_baselines.total_num_steps=-1.0",
         f"habitat_baselines.num_updates={updates}", f"habitat_baselines.rl.ppo.num_steps={steps}",
         f"habitat_baselines.num_checkpoints={2 * updates}", "habitat_baselines.log_interval=1",
         "habitat_baselines.rl.ppo.hidden_size=32",
         f"habitat_baselines.checkpoint_folder={folder}", f"habitat_baselines.tensorboard_dir={folder}/tb"],
        folder, **environment,
    )  # fmt: skip
    assert f"Num updates: {updates}" in text
    state = torch.load(folder / "latest.pth", map_location="cpu", weights_only=False)
    assert state["extra_state"]["step"] == updates * steps * environments
    found = state["state_dict"] if "state_dict" in state else state[0]["state_dict"]
    return text, found


def windows(text, name):
    """Values of a metric in the log, one per update."""
    return [float(x) for x in re.findall(rf"\b{name}: (-?[\d.]+|nan|inf)", text)]


def test_100_updates_among_people(pack, tmp_path):
    text, weights = train(
        pack, tmp_path, [f"--config-dir={CONFIGS}", "--config-name=ppo_avatar_pointnav"], 100, 8,
        GSNAV_PEOPLE="3", GSNAV_ACTION_SECONDS="0.25",
    )  # fmt: skip
    for name in ("collision_rate", "personal_space_intrusion", "human_collision"):
        seen = windows(text, name)
        assert len(seen) == 100 and all(0 <= x <= 1 for x in seen), name
    assert all(map(math.isfinite, windows(text, "reward"))) and len(windows(text, "avatar_navigation_reward")) == 100
    # The agent met people, so that the measures and the penalties had something to measure.
    assert max(windows(text, "personal_space_intrusion")) > 0
    assert all(bool(w.isfinite().all()) for w in weights.values())


def test_ddppo_in_one_process_learns_the_weights_of_workers(pack, tmp_path):
    import torch

    results = []
    for name, more in (("workers", []), ("one", [FACTORY])):
        folder = tmp_path / name
        folder.mkdir()
        results.append(
            train(
                pack, folder,
                ["--config-name=pointnav/ppo_pointnav_example.yaml", "habitat_baselines.trainer_name=ddppo",
                 "habitat_baselines.rl.ddppo.distrib_backend=GLOO", *more],
                3, 12, environments=3, GSNAV_DEVICE="cpu:2", MAIN_PORT="0",
            )
        )  # fmt: skip
    (first, wanted), (second, got) = results
    # Weights follow from all observations and rewards.
    assert wanted.keys() == got.keys() and all(torch.equal(wanted[k], got[k]) for k in wanted)
    for name in ("reward", "distance_to_goal", "spl"):
        assert windows(first, name) == windows(second, name) and len(windows(first, name)) == 3


def test_the_benchmark_of_two_ranks_accounts_for_the_time(tmp_path):
    text = run_module(
        [CONFIGS.parents[3] / "bench/habitat/steps_per_second.py", "--ranks=2", "--environments=2", "--updates=2",
         "--steps=6", f"--side={SIDE}", "--gaussians=20000", "--episodes=12", "--device=cpu", "--seconds=300",
         "--config=pointnav/ppo_pointnav_example.yaml", "habitat_baselines.rl.ppo.hidden_size=32"],
        tmp_path,
    )  # fmt: skip
    row = [x.strip() for x in re.search(r"^\| 2 \| 2 \|.*$", text, re.MULTILINE)[0].split("|")]
    rate, (least, most), mb = float(row[4]), map(float, row[5].split(", ")), float(row[6])
    ms = {name: float(x) for name, x in re.findall(r"^\| (\S.*?) \| (-?\d+\.\d) \|$", text, re.MULTILINE)}
    assert sum(x for name, x in ms.items() if name != "all") == pytest.approx(ms["all"], abs=0.5)
    # Rank 0 makes half of the steps, four per step of all environments.
    assert rate * ms["all"] == pytest.approx(4 * 1e3, rel=0.05) and least <= rate <= most
    assert ms["environments"] > 0 and ms["trainer: learning"] > 0 and mb > 100
    assert 0 < float(re.search(r"Drawing ran (\S+) ms", text)[1]) < ms["all"]
