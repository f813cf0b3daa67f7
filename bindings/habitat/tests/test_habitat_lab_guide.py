# SPDX-License-Identifier: Apache-2.0
"""Runs the numbered commands of docs/guide/habitat_lab.md, in order and as they stand there.

Commands that install something are run only with GSNAV_TEST_INSTALL=1, in a copy of the repository. The others use the
packages that are installed, and are skipped if Habitat-Lab or PyTorch is missing. A training is cut to three updates.
"""

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

gsnav = pytest.importorskip("gsnav")
ROOT = pathlib.Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/guide/habitat_lab.md"
REALLY = os.environ.get("GSNAV_TEST_INSTALL") == "1"
INSTALLS = ("apt-get ", "tools/install_deps.sh", "python3 -m venv", "pip install", "git clone")
# Makes a command short: settings that come later count.
SHORTER = {
    "make_habitat_pack.py": " --train 40 --others 8",
    "habitat_baselines.run": " habitat_baselines.total_num_steps=-1.0 habitat_baselines.num_updates=3",
    "habitat_baselines.evaluate=True": " habitat_baselines.test_episode_count=4",
}
STEP = re.compile(r"^\d+\. [^\n]*\n\n((?: {7,8}\S.*\n)(?: {7,}.*\n)*)", re.MULTILINE)


def commands():
    """The commands of the page, with lines that end in a backslash joined."""
    text = PAGE.read_text(encoding="utf-8")
    return [re.sub(r"\s*\\\n\s*", " ", block).strip() for block in STEP.findall(text)]


def shortened(command):
    """A command with settings of SHORTER before its "&&"."""
    first, both, rest = command.partition(" && ")
    for word, more in SHORTER.items():
        if word in command:
            first += more
    return first + both + rest


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """A function that runs a command in bash, in the folder and with the variables that the last one left."""
    folder = tmp_path_factory.mktemp("guide")
    if REALLY:
        subprocess.run(["git", "clone", "--quiet", "--shared", str(ROOT), str(folder / "gsnav")], check=True)
        folder = folder / "gsnav"
    else:
        for name in ("tools", "examples"):
            (folder / name).symlink_to(ROOT / name)
    flat = gsnav.open_scene("default", gsnav.OpenOptions(density=0.05))
    gsnav.io.save_scene(folder / "scan.ply", flat.scene.assets[0].cloud)
    kept = folder / "state"
    environment = {**os.environ, "PATH": f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    if not REALLY:
        paths = [str(ROOT / "bindings/habitat"), os.environ.get("PYTHONPATH", "")]
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
    state = {"cwd": folder, "env": environment}

    def run(command):
        script = f"set -e\n{command}\npwd > {kept}.pwd\nenv -0 > {kept}.env\n"
        where = {"cwd": state["cwd"], "env": state["env"]}
        done = subprocess.run(["bash", "-c", script], **where, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        state["cwd"] = pathlib.Path(pathlib.Path(f"{kept}.pwd").read_text().strip())
        rows = pathlib.Path(f"{kept}.env").read_bytes().decode().split("\0")
        state["env"] = dict(row.split("=", 1) for row in rows if "=" in row)
        return done.stdout + done.stderr, state["cwd"]

    return run


def test_the_page_has_ten_commands():
    found = commands()
    assert len(found) == 10 == len(re.findall(r"^\d+\. ", PAGE.read_text(encoding="utf-8"), re.MULTILINE))
    # Each setting that shortens a command is still that of one.
    assert all(sum(word in c for c in found) == (2 if word.endswith(".run") else 1) for word in SHORTER)


@pytest.mark.parametrize("number", range(1, 11))
def test_command(shell, number):
    command = commands()[number - 1]
    if command.startswith(INSTALLS) and not REALLY:
        pytest.skip(f"installs packages; run with GSNAV_TEST_INSTALL=1: {command}")
    if command.startswith("apt-get ") and (os.geteuid() != 0 or shutil.which("apt-get") is None):
        pytest.skip(f"needs root and apt-get: {command}")
    needed = () if REALLY or "make_habitat_pack" in command else ("habitat", "habitat_baselines", "torch")
    missing = [name for name in needed if importlib.util.find_spec(name) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed: {command}")
    output, folder = shell(shortened(command).replace("apt-get install", "apt-get install -y"))
    if "make_habitat_pack" in command:
        assert (folder / "data/datasets/pointnav/habitat-test-scenes/v1/train/train.json.gz").exists()
        assert (folder.parent / "scan.navmesh").exists()
    elif "evaluate=True" in command:
        assert "Average episode spl:" in output
    elif "habitat_baselines.run" in command:
        assert "Num updates: 3" in output or (folder / "data/new_checkpoints/latest.pth").exists()
    elif "draw_map" in command:
        assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")
