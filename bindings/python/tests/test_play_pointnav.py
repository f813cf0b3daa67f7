# SPDX-License-Identifier: Apache-2.0
"""Plays held-out episodes with the trained agent of examples/python, which needs no torch."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"


def play(*words, script="play_pointnav.py"):
    return subprocess.run([sys.executable, FOLDER / script, "--device", "cpu", *words], capture_output=True, text=True)


def test_the_trained_agent_reaches_goals_in_flats_it_has_never_seen():
    run = play("--episodes", "8", "--policies", "greedy", "random")
    assert run.returncode == 0, run.stderr
    spl = {line.split("|")[1].strip(): float(line.split("|")[3]) for line in run.stdout.splitlines()[2:]}
    assert spl["random"] < 0.1 and spl["greedy"] > 0.7  # 0.9 over 500 episodes
    assert (FOLDER / "pointnav_depth.npz").stat().st_size < 2e6


def test_errors_say_what_to_do(tmp_path):
    assert "Train first" in play("--weights", tmp_path / "checkpoint.pt").stderr
    assert "between 1 and 1,000,000" in play("--episodes", "0").stderr
    assert "there are" in play("--device", "tpu").stderr


def test_a_damaged_file_of_weights_ends_with_a_line(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from pointnav_policy import load

    whole, path, rng = (FOLDER / "pointnav_depth.npz").read_bytes(), tmp_path / "agent.npz", np.random.default_rng(3)
    ended = 0
    for _ in range(120):
        content = bytearray(whole)
        content[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        try:
            load(path)  # some bits do not matter
        except SystemExit as e:
            assert str(path) in str(e)
            ended += 1
    assert ended > 60
    with np.load(FOLDER / "pointnav_depth.npz") as file:
        weights = {name: file[name] for name in file.files}
    weights["cnn.0.weight"] = np.repeat(weights["cnn.0.weight"], 2, 1)
    np.savez(path, **weights)
    run = play("--weights", path)
    assert run.returncode != 0 and "2 channels" in run.stderr and "Traceback" not in run.stderr


def test_a_replay_shows_the_path_step_by_step(tmp_path):
    pytest.importorskip("matplotlib")
    from PIL import Image, ImageSequence

    out = tmp_path / "replay.webp"
    run = play("--episodes", "33", "--steps", "6", "--every", "2", "--out", out, script="pointnav_replay.py")
    assert run.returncode == 0, run.stderr
    assert "episode 33, flat 65: 6 steps, success 0" in run.stdout
    with Image.open(out) as replay:
        pictures = [np.asarray(p.convert("RGB"), np.float64) for p in ImageSequence.Iterator(replay)]
    assert len(pictures) == 4 and pictures[0].shape == (306, 800, 3)  # after 0, 2, 4 and 6 steps
    for part in (slice(10, 202), slice(260, 452), slice(470, 790)):  # depth, colours, map
        changes = [np.abs(a[26:218, part] - b[26:218, part]).max() for a, b in zip(pictures, pictures[1:])]
        assert min(changes) > 50, (part, changes)


def test_errors_of_the_replay_say_what_to_do():
    pytest.importorskip("matplotlib")
    assert "must end in .webp" in play("--out", "replay.mp4", script="pointnav_replay.py").stderr
    assert "between 0 and 1,000,000" in play("--episodes", "-1", script="pointnav_replay.py").stderr
