# SPDX-License-Identifier: Apache-2.0
"""Checkpoints of examples/python/train_pointnav.py with bad contents: a line names file, field and value."""

import argparse
import copy
import os
import pathlib
import pickle
import subprocess
import sys

import numpy as np
import pytest

torch = pytest.importorskip("torch")

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"
RESUMED, BEGUN, PLAYED = "for --out, or delete the file", "another file by --begin-with", "another file by --weights"
EVERY = (RESUMED, BEGUN, PLAYED)
NAN = float("nan")


class Uses:
    """A good checkpoint after five updates, and the functions that read it."""

    def __init__(self, path):
        import pointnav_checkpoint
        import pointnav_policy
        from pointnav_agent import Agent
        from pointnav_worlds import WORLDS_VERSION
        from train_pointnav import KEPT

        self.path, self.names = path, KEPT
        self.args = argparse.Namespace(**{name: 1 for name in KEPT} | {
            "size": 64, "blind": False, "sensor": "depth", "every": 5, "lr": 1e-3, "ranks": 1})
        self.reads = {RESUMED: lambda: pointnav_checkpoint.resumed(path, self.args, *self.made(), KEPT),
                      BEGUN: lambda: pointnav_checkpoint.begin_with(path, self.args, self.made()[0]),
                      PLAYED: lambda: pointnav_policy.load(path)}
        self.agent, columns = Agent, pointnav_checkpoint.COLUMNS
        agent, optimizer = self.made()
        for p in agent.parameters():
            p.grad = torch.full_like(p, 1e-3)
        optimizer.step()
        self.good = {"agent": agent.state_dict(), "optimizer": optimizer.state_dict(), "update": 5,
                     "log": [dict.fromkeys(columns, 1.0) for _ in range(5)], "digests": [bytes(32)],
                     "args": dict(vars(self.args)), "made_by": "a test",
                     "worlds_version": WORLDS_VERSION}

    def made(self):
        agent = self.agent(64, 1)
        return agent, torch.optim.Adam(agent.parameters(), self.args.lr, eps=1e-5)

    def refused(self, by, *texts):
        with pytest.raises(SystemExit) as error:
            self.reads[by]()
        line = str(error.value.code)
        assert "\n" not in line and line.startswith(f"{self.path}: ") and by in line, line
        assert all(text in line for text in texts), (line, texts)


@pytest.fixture
def uses(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    return Uses(tmp_path / "checkpoint.pt")


def changed(state, keys, change):
    """The state with another value under the keys. A function makes it of the old one."""
    state, (*to, last) = copy.deepcopy(state), keys
    holder = state
    for key in to:
        holder = holder[key]
    holder[last] = change(holder[last]) if callable(change) else change
    return state


def test_a_good_checkpoint_is_read(uses):
    torch.save(uses.good, uses.path)
    for read in uses.reads.values():
        read()
    agent, optimizer = uses.made()
    sys.modules["pointnav_checkpoint"].resumed(uses.path, uses.args, agent, optimizer, uses.names)
    assert torch.equal(agent.state_dict()["goal.bias"], uses.good["agent"]["goal.bias"])
    assert torch.equal(optimizer.state_dict()["state"][3]["exp_avg"], uses.good["optimizer"]["state"][3]["exp_avg"])


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU that PyTorch can use")
def test_an_agent_on_a_gpu_takes_the_weights_of_a_file(uses):
    import pointnav_checkpoint

    agent, path = uses.made()[0].to("cuda"), FOLDER / "pointnav_depth.npz"
    pointnav_checkpoint.begin_with(path, uses.args, agent)
    with np.load(path) as file:
        assert np.array_equal(agent.state_dict()["goal.bias"].cpu(), file["goal.bias"].astype(np.float32))


OPTIMIZER, STATE, GROUP = ("optimizer",), ("optimizer", "state"), ("optimizer", "param_groups", 0)
BIAS, LOG = ("agent", "goal.bias"), ("log", 2)


@pytest.mark.parametrize("keys,change,text", [
    (OPTIMIZER, {}, "optimizer is {}"), (OPTIMIZER, [1], "optimizer is [1]"), (OPTIMIZER, None, "optimizer is None"),
    (STATE, {}, "optimizer['state'] is {}"), (STATE, [1], "optimizer['state'] is [1]"),
    ((*STATE, 4), [], "optimizer['state'][4] is []"), ((*STATE, 4, "step"), "1", "['state'][4]['step'] is '1'"),
    ((*STATE, 4, "exp_avg"), torch.zeros(3), "['exp_avg'] is float32 [3], not float32 [32, 64, 3, 3]"),
    ((*STATE, 4, "exp_avg"), lambda x: x * NAN, "['exp_avg'] has the number nan"),
    ((*STATE, 4, "exp_avg_sq"), lambda x: x - 1, "['exp_avg_sq'] has the number -1"),
    ((*STATE, 4, "step"), torch.tensor(0.0), "['step'] has the number 0.0"),
    (GROUP[:2], {}, "optimizer['param_groups'] is {}"), (GROUP, {}, "['params'] is None"),
    ((*GROUP, "betas"), None, "[0]['betas'] is None, not (0.9, 0.999)"),
    ((*GROUP, "eps"), torch.zeros(2), "[0]['eps'] is float32 [2], not 1e-05"),
    (("update",), "5", "update is '5'"), (("update",), -5, "update is -5"), (("update",), 7, "update is 7"),
    (("update",), torch.tensor(5), "update is int64 []"), (("update",), 10, "log is [{"),
    (("log",), [], "log is []"), (("log",), {}, "log is {}"), (LOG, 3, "log[2] is 3"), (LOG, {}, "log[2] is {}"),
    ((*LOG, "spl"), "x", "log[2]['spl'] is 'x'"), ((*LOG, "frames"), 10**400, "log[2]['frames'] is 1000"),
    (("digests",), [], "digests is []"), (("digests",), ["x" * 32], "digests[0] is 'xxx"),
    (("digests",), [b"x"], "digests[0] is b'x', not 32 bytes"),
    (("made_by",), torch.zeros(2), "made_by is float32 [2]"),
    (("args", "lr"), torch.zeros(3), "args['lr'] is float32 [3]"), (("args", "every"), "5", "args['every'] is '5'"),
])
def test_bad_progress_is_named(keys, change, text, uses):
    torch.save(changed(uses.good, keys, change), uses.path)
    uses.refused(RESUMED, text)
    uses.reads[BEGUN](), uses.reads[PLAYED]()  # take weights only


ABSENT = object()


@pytest.mark.parametrize("held,shown,alone,among_people", [
    (1, "1", None, None), (2, "2", 2, 2), (3, "3", 3, 3), (ABSENT, "None", 2, None), (None, "None", None, None),
    (True, "True", None, None), (2.0, "2.0", None, None), ("2", "'2'", None, None),
    (torch.tensor(2), "int64 []", None, None)])
def test_a_run_goes_on_in_the_worlds_in_which_it_began(held, shown, alone, among_people, uses, monkeypatch):
    """`alone` and `among_people`: the version of the program that goes on without and with people."""
    for people, version in ((0, alone), (5, among_people)):
        uses.args.people = people
        state = {**uses.good, "args": dict(vars(uses.args)), "worlds_version": held}
        if held is ABSENT:
            del state["worlds_version"]
        torch.save(state, uses.path)
        for now in (2, 3):
            monkeypatch.setattr(sys.modules["pointnav_checkpoint"], "WORLDS_VERSION", now)
            if now == version:
                uses.reads[RESUMED]()
                continue
            with pytest.raises(SystemExit) as error:
                uses.reads[RESUMED]()
            line = str(error.value.code)
            assert line.startswith(f"{uses.path}: worlds_version is {shown}, not {now}: ") and "\n" not in line, line
            assert f"--begin-with {uses.path}" in line and "another folder for --out" in line, line
        uses.reads[BEGUN](), uses.reads[PLAYED]()  # take weights only


@pytest.mark.parametrize("keys,change,text", [
    (("agent",), {}, "agent is {}"), (("agent",), [1], "agent is [1]"), (("agent", 3), torch.zeros(3), "in agent is 3"),
    (BIAS, [1.0] * 32, "agent['goal.bias'] is [1.0, 1.0"), (BIAS, torch.zeros(31), "float32 [31]"),
    (BIAS, torch.zeros(32, dtype=torch.int64), "agent['goal.bias'] is int64 [32]"),
    (BIAS, torch.zeros(32, dtype=torch.bfloat16), "agent['goal.bias'] is bfloat16 [32]"),
    (BIAS, torch.zeros(32).to_sparse(), "not a dense array"),
    (BIAS, torch.zeros(32, device="meta"), "agent['goal.bias']"),
    (BIAS, torch.zeros(1).expand(10**12), "[1000000000000]"), (BIAS, lambda x: x * NAN, "nan"),
    (("agent", "gru.bias_hh_l0"), lambda x: x + float("inf"), "gru.bias_hh_l0"),
    (("agent", "cnn.0.weight"), lambda x: x[0], "float32 [1, 8, 8]"),
    (("args",), {}, "args['size'] is None"), (("args",), [], "args is []"),
    (("args", "size"), "64", "args['size'] is '64'"), (("args", "size"), True, "is True"),
    (("args", "size"), 10**9, "args['size'] is 1000000000"),
    (("args", "size"), torch.zeros(2), "args['size'] is float32 [2]"),
])
def test_bad_weights_are_named(keys, change, text, uses):
    state = copy.deepcopy(uses.good)
    state["agent"].setdefault(3 if keys[-1] == 3 else "goal.bias", None)
    torch.save(changed(state, keys, change), uses.path)
    for by in EVERY:
        uses.refused(by, text)


def test_what_is_no_checkpoint_is_refused(uses):
    for state, text in (([1, 2], "is [1, 2], not a dict"), (torch.zeros(3), "is float32 [3]"), (5, "is 5"),
                        ({}, "'agent' is missing")):
        torch.save(state, uses.path)
        for by in EVERY:
            uses.refused(by, text)
    for name in uses.good["agent"].keys() - {"value.weight", "value.bias"}:
        state = copy.deepcopy(uses.good)
        del state["agent"][name]
        torch.save(state, uses.path)
        for by in EVERY:
            uses.refused(by, repr(name), "missing")


class Hostile:
    """Its pickle makes a folder."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


def test_no_code_of_a_file_is_run(uses, tmp_path):
    hostile = Hostile(tmp_path / "ran")
    for zipped in (True, False):
        for state in (hostile, {**uses.good, "made_by": hostile}):
            torch.save(state, uses.path, _use_new_zipfile_serialization=zipped)
            for by in EVERY:
                uses.refused(by, "posix.mkdir, and no code of a file is run")
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        uses.path.write_bytes(pickle.dumps(hostile, protocol))
        for by in EVERY:
            uses.refused(by, "no checkpoint")
    torch.save(uses.agent(64, 1), uses.path)
    uses.refused(PLAYED, "pointnav_agent.Agent")
    from pointnav_policy import load

    path = tmp_path / "bad.npz"
    with np.load(FOLDER / "pointnav_depth.npz") as file:
        np.savez(path, **{**file, "goal.bias": np.array([hostile] * 32, dtype=object)})
    for content in (path.read_bytes(), pickle.dumps(hostile)):
        path.write_bytes(content)
        with pytest.raises(SystemExit, match="bad.npz: no weights of an agent: .*Name another file by --weights"):
            load(path)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("field,value,text", [
    ("size", np.zeros(2), "size is float64 [2]"), ("size", np.float64(64), "size is float64 []"),
    ("goal.bias", np.full(32, 1e300), "goal.bias is not finite: a weight is 1e+300"),
    ("goal.bias", np.array(["x"] * 32), "goal.bias is <U1 [32]"),
    ("goal.bias", np.zeros(32, int), "goal.bias is int64 [32]"),
    ("gru.weight_ih_l0", np.zeros((768, 64)), "float64 [768, 64], not of shape [768, 320]"),
    ("cnn.0.weight", np.zeros(3), "cnn.0.weight is float64 [3]"), ("policy.bias", np.zeros((2, 2)), "policy.bias"),
    ("policy.bias", np.float64(3), "policy.bias"),
])
def test_bad_arrays_are_named(field, value, text, uses, tmp_path):
    with np.load(FOLDER / "pointnav_depth.npz") as file:
        np.savez(tmp_path / "bad.npz", **{**file, field: value})
    uses.path = uses.args.begin_with = tmp_path / "bad.npz"
    import pointnav_checkpoint
    from pointnav_policy import load

    uses.reads = {BEGUN: lambda: pointnav_checkpoint.begin_with(uses.path, uses.args, uses.made()[0]),
                  PLAYED: lambda: load(uses.path)}
    uses.refused(BEGUN, text)
    uses.refused(PLAYED, text)


def test_arguments_that_are_missing_are_named(uses):
    state = copy.deepcopy(uses.good)
    del state["args"]["seed"]
    torch.save(state, uses.path)
    uses.refused(RESUMED, "args['seed'] is missing")


def test_weights_too_large_for_16_bits_are_not_written(uses, tmp_path):
    from pointnav_policy import load, save

    torch.save(changed(uses.good, (*BIAS,), torch.full((32,), 7e4)), uses.path)
    with pytest.raises(SystemExit, match="goal.bias has a weight of size 70000"):
        save(load(uses.path), tmp_path / "agent.npz")
    assert not (tmp_path / "agent.npz").exists()


def test_programs_end_with_a_line(uses, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["train_pointnav.py", "--rollout", "16", "--environments", "4", "--every", "5"])
    import train_pointnav

    args = vars(train_pointnav.arguments()) | {"flats": 2, "density": 0.05, "episodes_per_flat": 10, "ranks": 1}
    state = {**uses.good, "args": {name: args[name] for name in uses.names}, "optimizer": {}}
    torch.save(state, uses.path)
    tiny = ["--device", "cpu:1", "--flats", "2", "--density", "0.05", "--episodes-per-flat", "10", "--rollout", "16",
            "--environments", "4", "--every", "5"]
    bad = tmp_path / "bad.pt"
    torch.save(changed(state, BIAS, torch.zeros(31)), bad)
    train, play = ["train_pointnav.py", *tiny, "--out"], ["play_pointnav.py", "--device", "cpu:1", "--weights"]
    for words, line in (([*train, tmp_path], f"{uses.path}: optimizer is {{}}, not a dict"),
                        ([*train, tmp_path / "new", "--begin-with", bad], f"{bad}: agent['goal.bias'] is"),
                        ([*play, bad], f"{bad}: no weights of an agent: goal.bias is")):
        run = subprocess.run([sys.executable, FOLDER / words[0], *words[1:]], capture_output=True, text=True)
        assert run.returncode == 1 and run.stderr.startswith(line) and run.stderr.count("\n") == 1, run.stderr
