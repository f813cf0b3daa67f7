# SPDX-License-Identifier: Apache-2.0
"""Trains examples/python/train_pointnav.py for a few updates on the CPU: the same arguments give the same bits."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

torch = pytest.importorskip("torch")

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"
TINY = ["--device", "cpu:1", "--flats", "2", "--density", "0.05", "--episodes-per-flat", "10", "--rollout", "16"]
ONE_THREAD = {**os.environ, "OMP_NUM_THREADS": "1"}


def command(out, *more, environments=4, ranks=1, updates=10, every=5):
    start = [sys.executable]
    if ranks > 1:
        start += ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node", str(ranks)]
    steps = 16 * environments * ranks * updates
    return [*start, FOLDER / "train_pointnav.py", *TINY, "--out", out, "--environments", str(environments), "--every",
            str(every), "--steps", str(steps), *more]


def trained(*arguments, **keywords):
    """Hash of the run."""
    run = subprocess.run(command(*arguments, **keywords), env=ONE_THREAD, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return re.search(r"^hash (\w{16})$", run.stdout, re.MULTILINE)[1]


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """Folder and hash of ten updates in four environments."""
    out = tmp_path_factory.mktemp("first")
    return out, trained(out)


def rows(out):
    """The log without its last column, the time."""
    return [line.split(",")[:-1] for line in (out / "log.csv").read_text().splitlines()]


def test_two_runs_give_the_same_hash(first, tmp_path):
    assert trained(tmp_path) == first[1]
    assert trained(tmp_path / "other", "--seed", "2") != first[1]
    assert rows(tmp_path) == rows(first[0]) and len(rows(first[0])) == 11


def test_a_killed_run_goes_on_with_the_same_bits(first, tmp_path):
    run = subprocess.Popen(command(tmp_path), env=ONE_THREAD, stdout=subprocess.DEVNULL)
    while not (tmp_path / "checkpoint.pt").exists() and run.poll() is None:
        time.sleep(0.001)
    run.send_signal(signal.SIGKILL)
    assert run.wait() == -signal.SIGKILL  # else it was done before it could be killed
    assert torch.load(tmp_path / "checkpoint.pt", weights_only=True)["update"] == 5
    assert trained(tmp_path) == first[1]


def test_a_run_of_other_worlds_is_refused_and_its_weights_are_taken(first, tmp_path):
    kept = torch.load(first[0] / "checkpoint.pt", weights_only=True)
    assert kept["worlds_version"] == 2
    old = tmp_path / "old" / "checkpoint.pt"
    old.parent.mkdir()
    torch.save({**kept, "worlds_version": 1}, old)
    run = subprocess.run(command(old.parent), env=ONE_THREAD, capture_output=True, text=True)
    assert run.returncode == 1 and run.stderr.startswith(f"{old}: worlds_version is 1, not 2: "), run.stderr
    assert run.stderr.count("\n") == 1 and [p.name for p in old.parent.iterdir()] == [old.name], run.stderr
    trained(tmp_path / "new", "--begin-with", old, "--critic-updates", "1", updates=1, every=1)
    for name, value in weights(tmp_path / "new").items():
        assert name.startswith("value") or torch.equal(value, kept["agent"][name]), name


def weights(out):
    return torch.load(out / "checkpoint.pt", weights_only=True)["agent"]


def test_two_ranks_make_the_update_of_one_with_twice_the_environments(tmp_path):
    # Adam divides by the size of the gradient, so that small gradients would show every rounding: one update.
    trained(tmp_path / "one", "--lr", "0.01", environments=8, updates=1, every=1)
    trained(tmp_path / "two", "--lr", "0.01", environments=4, ranks=2, updates=1, every=1)
    one, two = weights(tmp_path / "one"), weights(tmp_path / "two")
    for name, value in one.items():
        assert torch.allclose(value, two[name], atol=1e-5), f"{name}: {(value - two[name]).abs().max()}"
    log = [[float(x) for x in rows(tmp_path / name)[1]] for name in ("one", "two")]
    assert log[0] == pytest.approx(log[1], abs=1e-5)


def test_a_folder_or_disk_that_takes_no_files_ends_the_run_with_a_line(tmp_path):
    def said(out, *limits):
        words = [*limits, *command(out, updates=1, every=1)]
        run = subprocess.run(words, env=ONE_THREAD, capture_output=True, text=True)
        assert run.returncode == 1 and run.stderr.startswith("train_pointnav.py: "), run.stderr
        assert run.stderr.count("\n") == 1 and not list(out.glob("part-*")), run.stderr
        return run.stderr

    assert "No such file" in said(pathlib.Path("/proc/folder"))
    # Files of at most 64 KiB: the checkpoint is larger.
    assert "too large" in said(tmp_path, "prlimit", "--fsize=65536")


def test_ranks_end_together(tmp_path):
    trained(tmp_path, "--minutes", "0", "--cut-off", "0.5", ranks=2, updates=50, every=1)
    assert len(rows(tmp_path)) == 2


def test_a_rollout_ends_early_once_enough_other_ranks_are_done(tmp_path):
    program = tmp_path / "straggle.py"
    program.write_text(f"import sys\nsys.path.insert(0, {str(FOLDER)!r})\n"
                       "import torch, train_pointnav\n"
                       "from pointnav_agent import Agent\n"
                       "from pointnav_worlds import Worlds\n"
                       "args = train_pointnav.arguments()\n"
                       "args.torch_device = torch.device('cpu')\n"
                       "agent = Agent(64, 1)\n"
                       "optimizer = torch.optim.Adam(agent.parameters())\n"
                       "learner = train_pointnav.Learner(args, agent, optimizer, Worlds(range(2), args, 10))\n"
                       "class Store:\n"
                       "    def add(self, name, n):\n"
                       "        return 1  # of two ranks is done\n"
                       "learner.ranks, learner.store = 2, Store()\n"
                       "learner.noise = torch.rand(33, 8, 4)[:, :4].contiguous()\n"
                       "learner.begin()\n"
                       "learner.collect()\n"
                       "assert learner.used == 8, learner.used  # a quarter of 32\n"
                       "reward, done, valid = learner.host_result\n"
                       "assert valid[:8].any() and not valid[8:].any() and not reward[8:].any()\n"
                       "assert not learner.host_start[9:].any()\n"
                       "learner.estimate(0)\n"
                       "assert not learner.advantage[8:].any()\n")
    words = [*TINY, "--rollout", "32", "--environments", "4", "--cut-off", "0.5", "--out", tmp_path]
    run = subprocess.run([sys.executable, program, *words], env=ONE_THREAD, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_rank_0_decides_for_all(tmp_path):
    program = tmp_path / "decide.py"
    program.write_text("import sys, torch, torch.distributed as dist\n"
                       f"sys.path.insert(0, {str(FOLDER)!r})\n"
                       "from pointnav_agent import agreed\n"
                       "dist.init_process_group('gloo')\n"
                       "rank, device = dist.get_rank(), torch.device('cpu')\n"
                       "assert [agreed(rank == 0, device), agreed(rank == 1, device)] == [True, False]\n"
                       "dist.destroy_process_group()\n")
    launch = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2", program]
    run = subprocess.run(launch, env=ONE_THREAD, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_two_ranks_that_were_stopped_go_on_with_the_same_bits(tmp_path):
    whole = trained(tmp_path / "whole", ranks=2, updates=4, every=2)
    trained(tmp_path / "parts", "--minutes", "0", ranks=2, updates=4, every=2)
    (tmp_path / "parts" / "log.csv").unlink()  # as if killed between checkpoint and log
    assert trained(tmp_path / "parts", ranks=2, updates=4, every=2) == whole
    assert trained(tmp_path / "parts", ranks=2, updates=4, every=2) == whole  # nothing is left to do
    assert rows(tmp_path / "parts") == rows(tmp_path / "whole")


def processes_of(folder):
    """Numbers of the processes whose command names the folder, without torchrun."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if str(folder).encode() in words and b"torch.distributed.run" not in words:
            found.append(int(entry.name))
    return sorted(found)


@pytest.mark.skipif(not pathlib.Path("/proc/self/cmdline").exists(), reason="finds the ranks by /proc")
def test_two_ranks_of_which_one_is_killed_go_on_with_the_same_bits(tmp_path):
    whole = trained(tmp_path / "whole", ranks=2, updates=6, every=2)
    killed = tmp_path / "killed"
    run = subprocess.Popen(command(killed, ranks=2, updates=6, every=2), env=ONE_THREAD, stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
    while not (killed / "checkpoint.pt").exists() and run.poll() is None:
        time.sleep(0.001)
    os.kill(processes_of(killed)[-1], signal.SIGKILL)
    assert run.wait() != 0  # torchrun ends the other rank
    assert torch.load(killed / "checkpoint.pt", weights_only=True)["update"] < 6
    assert trained(killed, ranks=2, updates=6, every=2) == whole


def test_errors_say_what_to_do(first, tmp_path):
    def refused(*words, script="train_pointnav.py"):
        run = subprocess.run([sys.executable, FOLDER / script, *words], capture_output=True, text=True)
        assert run.returncode != 0
        return run.stderr

    assert "another folder" in refused(*TINY, "--out", first[0], "--people", "1")
    same = [*TINY, "--environments", "4", "--every", "5", "--out", first[0]]
    assert "--not-deterministic True" in refused(*same, "--not-deterministic")
    assert "there are" in refused("--device", "tpu", "--out", tmp_path)
    assert "multiple of --chunks" in refused("--chunks", "3")
    for option, value in (("--chunks", "0"), ("--steps", "nan"), ("--lr", "-1"), ("--size", "35"), ("--density", "nan"),
                          ("--people", "-1"), ("--epochs", "0"), ("--success", "nan"), ("--every", "0"),
                          ("--cut-off", "0")):
        error = refused(*TINY, "--out", tmp_path / "none", option, value)
        assert f"argument {option}: {value} is not" in error
    file = tmp_path / "file"
    file.write_text("no folder")
    assert str(file) in refused(*TINY, "--out", file) and "Traceback" not in refused(*TINY, "--out", file)
    other = refused(*TINY, "--size", "80", "--out", tmp_path / "new", "--begin-with", first[0] / "checkpoint.pt")
    assert "--size 80" in other and "trained with 64" in other
    for words in (["--size", "80"], ["--sensor", "rgb"], ["--blind"]):
        other = refused(*TINY, *words, "--out", tmp_path / "new", "--begin-with", FOLDER / "pointnav_depth.npz")
        assert "pointnav_depth.npz: an agent of --size 64 --sensor depth" in other


def test_a_run_begins_with_a_file_of_weights(tmp_path):
    path = FOLDER / "pointnav_depth.npz"
    with np.load(path) as file:
        np.savez(tmp_path / "more.npz", **file, more=np.zeros(3))
    run = subprocess.run(command(tmp_path / "more", "--begin-with", tmp_path / "more.npz"), capture_output=True,
                         text=True)
    assert run.returncode == 1 and "more.npz: weights of another network" in run.stderr, run.stderr
    # The first update learns only the value.
    trained(tmp_path, "--begin-with", path, "--critic-updates", "1", updates=1, every=1)
    with np.load(path) as file:
        assert set(file.files) == {"size", *(name for name in weights(tmp_path) if not name.startswith("value"))}
        for name, value in weights(tmp_path).items():
            assert name.startswith("value") or np.array_equal(value, file[name]), name


@pytest.mark.parametrize("kind", ["empty", "text", "half", "other"])
def test_damaged_files_are_named(kind, first, tmp_path):
    whole = (first[0] / "checkpoint.pt").read_bytes()
    content = {"empty": b"", "text": b"no weights", "half": whole[:len(whole) // 2], "other": None}[kind]
    (tmp_path / "run").mkdir()
    for path, script, option in ((tmp_path / "run" / "checkpoint.pt", "train_pointnav.py", "--out"),
                                 (tmp_path / "begin.pt", "train_pointnav.py", "--begin-with"),
                                 (tmp_path / "begin.npz", "train_pointnav.py", "--begin-with"),
                                 (tmp_path / "agent.pt", "play_pointnav.py", "--weights"),
                                 (tmp_path / "agent.npz", "play_pointnav.py", "--weights")):
        if content is not None:
            path.write_bytes(content)
        elif path.suffix == ".npz":
            np.savez(path, size=np.int32(64), other=np.zeros(3))
        else:
            torch.save({"agent": {}}, path)
        words = [*TINY, "--out", path.parent if option == "--out" else tmp_path / "new"]
        words = [*words, "--begin-with", path] if option == "--begin-with" else words
        words = ["--device", "cpu:1", "--weights", path] if script == "play_pointnav.py" else words
        run = subprocess.run([sys.executable, FOLDER / script, *words], capture_output=True, text=True)
        assert run.returncode == 1 and str(path) in run.stderr and "Traceback" not in run.stderr, run.stderr


def test_weights_that_do_not_fit_are_refused(first, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_policy import load, save

    save(load(first[0] / "checkpoint.pt"), tmp_path / "agent.npz")
    with np.load(tmp_path / "agent.npz") as file:
        good = dict(file)
    assert load(tmp_path / "agent.npz").size == 64

    def refused(words, **changes):
        np.savez(tmp_path / "bad.npz", **{**good, **changes})
        with pytest.raises(SystemExit, match=words) as error:
            load(tmp_path / "bad.npz")
        assert "bad.npz" in str(error.value)

    refused("goal.bias is not finite", **{"goal.bias": np.full_like(good["goal.bias"], np.nan)})
    refused("3 actions", **{"policy.weight": good["policy.weight"][:3], "policy.bias": good["policy.bias"][:3]})
    refused("size 9 is not between", size=np.int32(9))
    refused("no weights of an agent", size=np.int32(80))
    refused("no weights of an agent", **{"gru.bias_hh_l0": good["gru.bias_hh_l0"][:-1]})


@pytest.fixture(scope="module")
def mixture(tmp_path_factory):
    """Folder of three updates from colours and depth, in a flat of Gaussians and one of triangles."""
    out = tmp_path_factory.mktemp("mixture")
    trained(out, *RGBD, "--worlds", "both", updates=3, every=3)
    return out


RGBD = ["--sensor", "rgbd", "--size", "48", "--quality", "fast"]


def test_flats_of_gaussians_and_of_triangles_train_an_agent(mixture, tmp_path):
    for worlds in ("gaussians", "meshes"):
        trained(tmp_path / worlds, *RGBD, "--worlds", worlds, updates=3, every=3)
    made = [weights(folder)["cnn.0.weight"] for folder in (mixture, tmp_path / "gaussians", tmp_path / "meshes")]
    assert all(w.shape == (32, 4, 8, 8) for w in made)
    assert not torch.equal(made[0], made[1]) and not torch.equal(made[1], made[2])
    run = subprocess.run([sys.executable, FOLDER / "play_pointnav.py", "--device", "cpu:1", "--worlds", "meshes",
                          "--quality", "fast", "--weights", mixture / "checkpoint.pt", "--episodes", "2",
                          "--policies", "agent", "follower"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert [line.split("|")[1].strip() for line in run.stdout.splitlines()[2:]] == ["agent", "follower"]


@pytest.mark.parametrize("name,size,channels", [("first", 64, 1), ("mixture", 48, 4)])
def test_the_policy_in_numpy_is_the_agent(name, size, channels, request, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_agent import Agent
    from pointnav_policy import load, save

    folder = request.getfixturevalue(name)
    path = (folder if channels == 4 else folder[0]) / "checkpoint.pt"
    state = torch.load(path, weights_only=True)
    agent = Agent(size, channels)
    agent.load_state_dict(state["agent"])
    policy = load(path)
    rng = np.random.default_rng(1)
    seen, goal = rng.uniform(0, 8, (5, size, size, channels)), rng.normal(size=(5, 3))
    last, start, hidden = rng.integers(0, 4, 5), np.arange(5) % 3 == 0, rng.normal(size=(5, 256))
    seen, goal, hidden = (x.astype(np.float32) for x in (seen, goal, hidden))
    log_p, next_hidden = policy.act(seen, goal, last, start, hidden)
    with torch.no_grad():
        images = [torch.from_numpy(x) for x in np.split(seen, [3] if channels == 4 else [], -1)]
        inputs = agent.features(images, torch.from_numpy(goal), torch.from_numpy(np.where(start, 4, last)))
        y, state = agent.gru(inputs[None], torch.from_numpy(hidden * ~start[:, None])[None])
        expected, _ = agent.heads(y[0])
    assert np.abs(log_p - expected.numpy()).max() < 1e-5 and np.abs(next_hidden - state[0].numpy()).max() < 1e-5
    save(policy, tmp_path / "policy.npz")
    assert np.abs(load(tmp_path / "policy.npz").act(seen, goal, last, start, hidden)[0] - log_p).max() < 0.01


def test_determinism_is_left_out_if_asked(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_agent import set_determinism

    name = "CUBLAS_WORKSPACE_CONFIG"
    monkeypatch.setenv(name, "")  # so that the end of the test restores it
    monkeypatch.delenv(name)
    try:
        for on in (False, True):
            set_determinism(on)
            assert torch.are_deterministic_algorithms_enabled() == on != torch.backends.cudnn.benchmark
            assert os.environ.get(name) == (":4096:8" if on else None)
    finally:
        torch.use_deterministic_algorithms(False)


def test_the_speed_of_the_environments_is_printed():
    run = subprocess.run([sys.executable, FOLDER / "pointnav_speed.py", "--device", "cpu:1", "--flats", "2",
                          "--environments", "4", "--steps", "3", "--runs", "2"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert re.search(r"cpu:1: [\d,]+ environment steps/s", run.stdout)


def test_turns_of_a_mirrored_environment_are_seen_mirrored(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_agent import Mirror
    from pointnav_worlds import LEFT, goals

    import gsnav

    scene = gsnav.default_simulator_scene(people=0, density=0.05)
    episode = gsnav.BatchEpisode(scene=0, episode=gsnav.generate_episodes(scene.navmesh, 1, 1)[0])
    sensor = gsnav.SensorSpec(uuid="depth", kind=gsnav.SensorKind.depth, resolution=[64, 64])
    simulator = gsnav.BatchSimulator("cpu:1", [scene], gsnav.BatchConfig(sensors=[sensor]), 4, lambda e, n: episode)
    mirror = Mirror(True, 0, 4, torch.device("cpu"))

    def angles(step):
        _, cosine, sine = mirror.goals(goals(step)).T
        return np.degrees(np.arctan2(sine, cosine))

    def images(step):
        return mirror.images([torch.from_numpy(step.images["depth"].copy())])[0].numpy()[..., 0]

    before = simulator.reset()
    first = angles(before)
    assert np.allclose(first, first[0] * np.array([1, -1, 1, -1]), atol=1e-4)
    seen = images(before)
    assert np.array_equal(seen[1], seen[0][:, ::-1])
    # A turn to the left moves the goal and the image to the right, in all environments.
    after = simulator.step(mirror.actions(np.full(4, LEFT)))
    turned = (first - angles(after) + 180) % 360 - 180
    assert np.allclose(turned, turned[0], atol=1e-4) and turned[0] > 5
    for was, now in zip(seen, images(after)):
        error = [np.median(np.abs(was[:, 16:-16] - now[:, 16 + s:48 + s])) for s in range(-16, 17)]
        assert np.argmin(error) > 16, error
    assert np.array_equal(Mirror(False, 0, 4, torch.device("cpu")).actions(np.arange(4)), np.arange(4))


def test_penalties_are_a_factor_on_what_people_cost(monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    import argparse

    from pointnav_worlds import Draw, Worlds

    args = argparse.Namespace(device="cpu:1", people=5, quality="fast", worlds="gaussians", rooms=2, density=0.05)
    actions = np.random.default_rng(1).choice([1, 1, 2, 3], (60, 8))

    def rewards(penalties):
        worlds = Worlds(range(1), args, 8, penalties=penalties)
        assert len({e.episode.start_time for e in worlds.episodes}) == 8
        simulator = worlds.simulator(args, 8, [], Draw(worlds, 1, 0))
        simulator.reset()
        return np.array([simulator.step(row).rewards.copy() for row in actions])

    none, tenth, all_of_them = rewards(0.0), rewards(0.1), rewards(1.0)
    cost = none - all_of_them
    assert np.allclose(none - tenth, 0.1 * cost, atol=1e-6)
    # A collision costs 0.5 and up to 0.25 for being near: nothing lies between 0.25 and 0.5.
    assert cost.min() > -1e-6 and cost.max() < 0.75 + 1e-6 and not ((cost > 0.251) & (cost < 0.499)).any()
    assert ((cost > 0.001) & (cost < 0.251)).sum() > 20 and (cost > 0.499).sum() > 5
