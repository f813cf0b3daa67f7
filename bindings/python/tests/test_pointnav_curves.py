# SPDX-License-Identifier: Apache-2.0
"""Curves of several training runs in one picture."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest

FOLDER = pathlib.Path(__file__).parents[3] / "examples" / "python"


def run(*words):
    return subprocess.run([sys.executable, FOLDER / "pointnav_curves.py", *words], capture_output=True, text=True)


def log_of(folder, spl):
    folder.mkdir()
    rows = [f"{i},{100 * (i + 1)},{value}" for i, value in enumerate(spl)]
    (folder / "log.csv").write_text("\n".join(["update,frames,spl", *rows]))
    return folder / "log.csv"


@pytest.fixture
def lines_of(tmp_path, monkeypatch):
    """Draws logs, and returns the lines by their names."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.syspath_prepend(FOLDER)
    monkeypatch.setattr(pyplot, "close", lambda figure: None)
    import pointnav_curves

    def draw(logs):
        monkeypatch.setattr(sys, "argv", ["curves", *map(str, logs), "--metrics", "spl", "--mean", "4",
                                          "--out", str(tmp_path / "out.png")])
        pointnav_curves.main()
        return {line.get_label(): line.get_xydata() for line in pyplot.gcf().axes[0].lines}

    return draw


def test_curves_are_moving_means_of_each_run(tmp_path, lines_of):
    runs = {n: np.random.default_rng(i).random(20).tolist() for i, n in enumerate(("meshes", "both"))}
    lines = lines_of([log_of(tmp_path / name, spl) for name, spl in runs.items()])
    assert set(lines) == set(runs)
    for name, spl in runs.items():
        np.testing.assert_allclose(lines[name][:, 1], np.convolve(spl, np.full(4, 0.25), "valid"))
        np.testing.assert_allclose(lines[name][:, 0], np.arange(400, 2001, 100))
    assert (tmp_path / "out.png").read_bytes()[:4] == b"\x89PNG"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["both", "meshes", "out.png"]


def test_no_run_is_lost_where_names_are_equal(tmp_path, lines_of):
    logs = []
    for i, place in enumerate(("a", "b")):
        (tmp_path / place).mkdir()
        logs.append(log_of(tmp_path / place / "run", [0.1 + i] * 5))
    lines = lines_of([*logs, log_of(tmp_path / "other", [5] * 5)])
    assert {name: line[0, 1] for name, line in lines.items()} == pytest.approx(
        {str(logs[0]): 0.1, str(logs[1]): 1.1, "other": 5})


def test_errors_name_the_file_and_the_field(tmp_path):
    good, word = log_of(tmp_path / "good", [0.5] * 12), log_of(tmp_path / "word", [0.5, "high"])
    empty, binary = log_of(tmp_path / "empty", []), log_of(tmp_path / "binary", [])
    binary.write_bytes(b"frames,spl\n\xff\xfe,1\n")
    for words, text in [((good,), "has no column success"), ((word, "--metrics", "spl"), "row 2: spl is 'high'"),
                        ((empty,), "has no rows"), ((binary,), f"{binary}: no table of numbers: 'utf-8' codec"),
                        ((tmp_path / "none.csv",), "No such file"),
                        ((good, "--metrics", "spl", "--mean", "13"), "--mean is 13"),
                        ((good, "--metrics", "spl", "--mean", "0"), "--mean is 0")]:
        tried = run(*words)
        assert tried.returncode == 1 and text in tried.stderr and "Traceback" not in tried.stderr, tried.stderr


def test_pictures_that_cannot_be_written_leave_nothing(tmp_path):
    pytest.importorskip("matplotlib")
    good = log_of(tmp_path / "good", [0.5] * 12)
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "old.png").write_text("old")
    for name, text in (("curves", ".pdf, .pgf, .png, "), ("curves.mp4", ".svgz, .tif, .tiff or .webp"),
                       ("none/curves.png", "there is no folder"), ("folder.png", "is a folder"), ("x.", "must end in")):
        tried = run(good, "--metrics", "spl", "--out", tmp_path / name)
        assert tried.returncode == 1 and tried.stderr.startswith(f"pointnav_curves.py: --out {tmp_path / name}"), tried
        assert text in tried.stderr and tried.stderr.count("\n") == 1, tried.stderr
        assert sorted(p.name for p in tmp_path.iterdir()) == ["folder.png", "good", "old.png"], name
    assert run(good, "--metrics", "spl", "--out", tmp_path / "UPPER.PNG").returncode == 0


def test_a_file_is_whole_or_as_it_was(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(FOLDER)
    from pointnav_files import aside

    path = tmp_path / "log.csv"
    path.write_text("old")
    for error in (OSError, KeyboardInterrupt):
        with pytest.raises(error), aside(path) as part:
            part.write_text("ne")
            raise error
        assert [p.name for p in tmp_path.iterdir()] == ["log.csv"] and path.read_text() == "old"
    with aside(path) as part:
        assert part.suffix == ".csv" and part.parent == tmp_path
        part.write_text("new")
    assert [p.name for p in tmp_path.iterdir()] == ["log.csv"] and path.read_text() == "new"
