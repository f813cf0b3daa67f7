# SPDX-License-Identifier: Apache-2.0
"""Plays held-out episodes with the trained agent of examples/python, which needs no torch."""

import argparse
import pathlib
import select
import signal
import statistics
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import gsnav

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"


def play(*words, script="play_pointnav.py"):
    return subprocess.run([sys.executable, FOLDER / script, "--device", "cpu", *words], capture_output=True, text=True)


def table(printed):
    """The table: for each policy and metric, mean and standard error."""
    head, _, *rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in printed.splitlines()]
    return {name: {key: tuple(map(float, c.split(" ± "))) for key, c in zip(head[1:], cells)} for name, *cells in rows}


def test_the_trained_agent_reaches_goals_in_flats_it_has_never_seen():
    run = play("--episodes", "8", "--policies", "greedy", "random")
    assert run.returncode == 0, run.stderr
    spl = {name: values["spl"][0] for name, values in table(run.stdout).items()}
    assert spl["random"] < 0.1 and spl["greedy"] > 0.7  # 0.9 over 500 episodes
    assert (FOLDER / "pointnav_depth.npz").stat().st_size < 2e6


class Wanders:
    """Follows the shortest path in some episodes. In others it walks in circles, and ends after a while."""

    def __init__(self):
        self.follower = gsnav.GeodesicFollower()

    def next(self, world):
        m = world.metrics()
        if m.start_distance > 4:
            return self.follower.next(world)
        if m.steps > 40 * m.start_distance:
            return gsnav.Action.stop
        return gsnav.Action.turn_left if m.steps % 5 == 0 else gsnav.Action.move_forward


def test_the_table_has_means_and_standard_errors_over_episodes(monkeypatch, capsys):
    """Truth: the episodes one after the other in a simulator of one agent."""
    monkeypatch.syspath_prepend(FOLDER)
    import play_pointnav
    from pointnav_worlds import Worlds

    args = argparse.Namespace(people=5, rooms=2, density=0.05, quality="exact", worlds="gaussians")
    worlds, policy, ended = Worlds(range(64, 65), args, 9), Wanders(), []
    simulator = gsnav.Simulator("cpu:1", worlds.scenes[0], gsnav.SimulatorConfig(task=worlds.task, sensors=[]))
    for e in worlds.episodes:
        simulator.reset(e.episode)
        while not simulator.done:
            simulator.step(policy.next(simulator.world))
        ended.append(simulator.metrics())
    monkeypatch.setattr(gsnav, "GeodesicFollower", lambda: policy)
    monkeypatch.setattr(play_pointnav, "Worlds", lambda *arguments: worlds)

    def played(count):
        monkeypatch.setattr(sys, "argv", ["play_pointnav.py", "--device", "cpu:1", "--people", "5", "--policies",
                                          "follower", "--batch", "4", "--episodes", str(count)])
        play_pointnav.main()
        return table(capsys.readouterr().out)["follower"]

    found = played(9)
    for key, (mean, error) in found.items():
        values = [float(getattr(m, key)) for m in ended]
        assert mean == pytest.approx(statistics.mean(values), abs=6e-4), (key, values)
        assert error == pytest.approx(statistics.stdev(values) / 3, abs=6e-4) and error > 0.002, (key, values)
    # An episode counts once, whatever its length.
    rates = [m.collision_steps / m.steps for m in ended]
    assert found["collision_rate"][0] == pytest.approx(statistics.mean(rates), abs=6e-4)
    assert abs(sum(m.collision_steps for m in ended) / sum(m.steps for m in ended) - statistics.mean(rates)) > 2e-3
    assert all(np.isnan(error) for _, error in played(1).values())


def test_errors_say_what_to_do(tmp_path):
    assert "Train first" in play("--weights", tmp_path / "checkpoint.pt").stderr
    assert "between 1 and 1,000,000" in play("--episodes", "0").stderr
    assert "there are" in play("--device", "tpu").stderr


# Says when a thread begins to make a flat with a thousand people, which takes minutes.
MAKES_FLATS = """
import os, signal, sys
import gsnav
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have ignored it
make = gsnav.planned_simulator_scene
def said(*arguments):
    os.write(1, b"making\\n")
    return make(*arguments)
gsnav.planned_simulator_scene = said
name, sys.path[0] = sys.argv.pop(1), sys.argv.pop(1)
program = __import__(name)
program.run_program(program.main)
"""


@pytest.mark.parametrize("name", ["play_pointnav", "train_pointnav"])
def test_ctrl_c_does_not_wait_for_flats(name, tmp_path):
    if name == "train_pointnav":
        pytest.importorskip("torch")
    words = [sys.executable, "-c", MAKES_FLATS, name, FOLDER, "--people", "1000", "--density", "0.05",
             *(["--out", tmp_path] if name == "train_pointnav" else [])]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as run:
        try:
            assert select.select([run.stdout], [], [], 300)[0] and run.stdout.readline() == "making\n"
            time.sleep(1)  # the thread is in C++
            assert run.poll() is None
            run.send_signal(signal.SIGINT)
            sent = time.monotonic()
            out, errors = run.communicate(timeout=60)
            assert time.monotonic() - sent < 5  # mostly 0.1 s; other processes may take the processor
        finally:
            run.kill()
    assert run.returncode == 1 and errors == "-c: stopped\n" and set(out.split()) <= {"making"}, (errors, out)
    assert not list(tmp_path.iterdir())


def test_an_error_in_a_flat_ends_the_others(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_worlds import in_threads

    ended = []

    def make(seed):
        if seed == 1:
            raise ValueError(f"flat {seed}")
        time.sleep(0.3)
        ended.append(seed)
        return seed

    assert in_threads(lambda seed: -seed, range(40)) == [-seed for seed in range(40)]
    before = threading.active_count()
    with pytest.raises(ValueError, match="flat 1"):
        in_threads(make, range(200))
    assert len(ended) < 40 and threading.active_count() == before, ended


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
