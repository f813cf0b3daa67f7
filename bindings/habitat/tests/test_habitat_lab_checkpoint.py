# SPDX-License-Identifier: Apache-2.0
"""habitat-baselines, unmodified, evaluates a checkpoint and resumes a training. Skipped where it is not installed."""

import gzip
import importlib.util
import json
import re

import pytest

for _name in ("habitat", "habitat_baselines", "torch", "gsnav"):
    if importlib.util.find_spec(_name) is None:
        pytest.skip(f"{_name} is not installed", allow_module_level=True)
from test_habitat_lab import overrides_of, run_module  # noqa: E402
from test_habitat_lab_training import FACTORY, SMALL, train  # noqa: E402

pytestmark = pytest.mark.filterwarnings("default")
PPO = "--config-name=pointnav/ppo_pointnav_example.yaml"
# Since PyTorch 2.6 checkpoints with objects need it.
TORCH = {"TORCH_FORCE_NO_WEIGHTS_ONLY_LOAD": "1"}
RESUMED_FROM, UPDATES, STEPS, ENVIRONMENTS = 2, 4, 8, 2


def resumable(pack, folder):
    """Trains, or goes on. The state is saved before the third update."""
    arguments = [PPO, f"habitat_baselines.rl.preemption.save_resume_state_interval={RESUMED_FROM + 1}"]
    return train(pack, folder, arguments, UPDATES, STEPS, ENVIRONMENTS, **TORCH)


@pytest.fixture(scope="module")
def trained(pack, tmp_path_factory):
    """Folder of a training, and its log."""
    folder = tmp_path_factory.mktemp("trained")
    return folder, resumable(pack, folder)[0]


def updates_in(text):
    """Numbers of updates and of frames in a log."""
    return [tuple(map(int, found)) for found in re.findall(r"Num updates: (\d+)\s+Num frames (\d+)", text)]


def evaluate(pack, folder, checkpoint, *more):
    """Averages that an evaluation of all episodes prints, and its output."""
    text = run_module(
        ["-m", "habitat_baselines.run", PPO, *overrides_of(pack), *SMALL, "habitat_baselines.evaluate=True",
         f"habitat_baselines.num_environments={ENVIRONMENTS}", "habitat_baselines.test_episode_count=-1",
         "habitat_baselines.eval.video_option=[]", "habitat_baselines.load_resume_state_config=False",
         "habitat_baselines.rl.ppo.hidden_size=32",
         f"habitat_baselines.eval_ckpt_path_dir={checkpoint}", f"habitat_baselines.tensorboard_dir={folder}/tb", *more],
        folder, **TORCH,
    )  # fmt: skip
    return {k: float(v) for k, v in re.findall(r"Average episode (\w+): (-?[\d.]+|nan|inf)", text)}, text


def test_the_checkpoint_of_a_training_is_evaluated(pack, trained, tmp_path):
    averages, text = evaluate(pack, tmp_path, trained[0] / f"ckpt.{UPDATES - 1}.pth")
    assert f"Loaded checkpoint trained for {UPDATES * STEPS * ENVIRONMENTS} steps" in text
    assert 0 <= averages["spl"] <= averages["success"] <= 1 and averages["distance_to_goal"] > 0


@pytest.mark.parametrize("more", [[], [FACTORY]], ids=["workers", "one-process"])
def test_an_agent_that_stops_at_once_is_as_far_from_its_goals_as_the_episodes_say(pack, trained, tmp_path, more):
    import torch

    made = torch.load(trained[0] / "latest.pth", map_location="cpu", weights_only=False)
    (layer,) = [k.removesuffix("bias") for k in made["state_dict"] if k.endswith("action_distribution.linear.bias")]
    made["state_dict"][layer + "weight"].zero_()
    made["state_dict"][layer + "bias"].copy_(torch.tensor([60.0, 0, 0, 0]))  # "stop" is the first action.
    torch.save(made, tmp_path / "stops.pth")
    averages, _ = evaluate(pack, tmp_path, tmp_path / "stops.pth", *more)
    episodes = pack / "data/datasets/pointnav/habitat-test-scenes/v1/val/val.json.gz"
    rows = json.loads(gzip.decompress(episodes.read_bytes()))["episodes"]
    far = [row["info"]["geodesic_distance"] for row in rows]
    assert averages["distance_to_goal"] == pytest.approx(sum(far) / len(far), abs=1e-3)
    assert averages["success"] == averages["spl"] == 0


def test_a_training_goes_on_from_its_saved_state(pack, trained, tmp_path):
    import torch
    from habitat.config import read_write

    folder, text = trained
    frames = STEPS * ENVIRONMENTS
    assert updates_in(text) == [(n, n * frames) for n in range(1, UPDATES + 1)]
    own = tmp_path / "resumed"
    own.mkdir()
    state = torch.load(folder / ".habitat-resume-state.pth", map_location="cpu", weights_only=False)
    assert state["requeue_stats"]["num_updates_done"] == RESUMED_FROM
    # With a learning rate of 0 the weights stay those of the state, so that they show where they come from.
    for group in state["optim_state"]["param_groups"]:
        group["lr"] = group["initial_lr"] = 0.0
    state["lr_sched_state"]["base_lrs"] = [0.0 for _ in state["lr_sched_state"]["base_lrs"]]
    with read_write(state["config"]):
        state["config"].habitat_baselines.checkpoint_folder = str(own)
    torch.save(state, own / ".habitat-resume-state.pth")
    again, weights = resumable(pack, own)
    assert "Loading resume state" in again
    assert updates_in(again) == [(n, n * frames) for n in range(RESUMED_FROM + 1, UPDATES + 1)]
    wanted = state["state_dict"]
    learned = [k for k in wanted if "running_mean_and_var" not in k]
    assert wanted.keys() == weights.keys() and all(torch.equal(wanted[k], weights[k]) for k in learned)
    # The statistics of images, which are no weights, go on from those of the state.
    (seen,) = [k for k in wanted if k.endswith("running_mean_and_var._count")]
    assert weights[seen] - wanted[seen] == (UPDATES - RESUMED_FROM) * frames
