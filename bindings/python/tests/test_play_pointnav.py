# SPDX-License-Identifier: Apache-2.0
"""Plays held-out episodes with the trained agent of examples/python, which needs no torch."""

import pathlib
import subprocess
import sys

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"


def play(*words):
    return subprocess.run([sys.executable, FOLDER / "play_pointnav.py", "--device", "cpu", *words],
                          capture_output=True, text=True)


def test_the_trained_agent_reaches_goals_in_flats_it_has_never_seen():
    run = play("--episodes", "8", "--policies", "greedy", "random")
    assert run.returncode == 0, run.stderr
    spl = {line.split("|")[1].strip(): float(line.split("|")[3]) for line in run.stdout.splitlines()[2:]}
    assert spl["random"] < 0.1 and spl["greedy"] > 0.7  # 0.9 over 500 episodes
    assert (FOLDER / "pointnav_depth.npz").stat().st_size < 2e6


def test_errors_say_what_to_do(tmp_path):
    assert "Train first" in play("--weights", tmp_path / "checkpoint.pt").stderr
    assert "1 or more" in play("--episodes", "0").stderr
    assert "there are" in play("--device", "tpu").stderr
