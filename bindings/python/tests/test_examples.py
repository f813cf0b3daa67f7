# SPDX-License-Identifier: Apache-2.0
"""Runs each example in a process of its own, and checks the types of all."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

EXAMPLES = pathlib.Path(__file__).parents[3] / "examples" / "python"
NEEDS = {"vector_env.py": "gymnasium", "plot.py": "matplotlib", "on_ray.py": "ray", "on_jax.py": "jax",
         "on_torch.py": "torch"}
WRITES = {"render_scan.py": "scan.npz", "plot.py": "plot.png", "on_ray.py": "journal.jsonl",
          "convert_scene.py": "scene.spz"}


# These have tests of their own (test_train_pointnav.py), and need torch.
LONG = sorted(EXAMPLES.glob("*pointnav*.py"))
SHORT = sorted(set(EXAMPLES.glob("*.py")) - set(LONG))


@pytest.mark.parametrize("name", [p.name for p in SHORT])
def test_example(name, tmp_path):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    lines = (EXAMPLES / name).read_text().splitlines()
    assert 15 <= len(lines) <= 40
    subprocess.run([sys.executable, "-W", "error::UserWarning", EXAMPLES / name], check=True, cwd=tmp_path)
    if name in WRITES:
        assert (tmp_path / WRITES[name]).stat().st_size > 1000


@pytest.mark.parametrize("name", ["render_scan.py", "plot.py"])
def test_a_file_that_cannot_be_written_is_as_it_was(name, tmp_path):
    resource = pytest.importorskip("resource")
    if name in NEEDS:
        pytest.importorskip(NEEDS[name])
    path = tmp_path / WRITES[name]
    path.write_bytes(b"old")

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))  # bytes of a file

    run = subprocess.run([sys.executable, EXAMPLES / name], cwd=tmp_path, capture_output=True, text=True,
                         env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}, preexec_fn=limit)
    assert run.returncode == 1 and "File too large" in run.stderr, run.stderr
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("examples", [[p for p in SHORT if p.name != "on_torch.py"],
                                      [*LONG, EXAMPLES / "on_torch.py"]], ids=["short", "torch"])
def test_types_of_the_examples(tmp_path, examples):
    pytest.importorskip("mypy")
    if LONG[0] in examples:
        pytest.importorskip("torch")
        if int(np.__version__.split(".")[0]) < 2:
            pytest.skip("numpy 1 asks for type arguments of ndarray that numpy 2 has by default")
    settings = EXAMPLES.parents[1] / "pyproject.toml"
    run = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--config-file", settings, "--cache-dir", tmp_path,
                          *examples], capture_output=True, text=True, cwd=tmp_path)
    assert run.returncode == 0, run.stdout
    assert len(LONG[-1].read_text().splitlines()) <= 400
