# SPDX-License-Identifier: Apache-2.0
"""tools/make_habitat_pack.py makes episodes in a scan that the simulator opens with the same NavMesh."""

import os
import sys

import habitat_sim
import pytest
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


def test_episodes_in_a_scan(pack_tool, tmp_path, capsys):
    flat = gsnav.open_scene("default", gsnav.OpenOptions(density=0.05))
    scan = tmp_path / "flat.ply"
    gsnav.io.save_scene(scan, flat.scene.assets[0].cloud)
    pack_tool.make_of_scans(tmp_path / "pack", [scan], 7, 2)
    assert "from the Gaussians" in capsys.readouterr().out
    with habitat_sim.Simulator(make_cfg({"scene": str(scan), "width": 8, "height": 8})) as sim:
        saved = gsnav.load_navmesh(scan.with_suffix(".navmesh"))
        assert sim.pathfinder.navigable_area == saved.navigable_area() > 10
        for split, count in (("train", 7), ("val", 2), ("test", 2)):
            folder = tmp_path / "pack/data/datasets/pointnav/habitat-test-scenes/v1"
            found, warnings = gsnav.io.load_episodes(folder / split / f"{split}.json.gz")
            assert not warnings
            assert [e.id for e in found] == [str(i) for i in range(count)]
            for episode in found:
                assert episode.scene_id == str(scan)
                path = habitat_sim.ShortestPath()
                path.requested_start, path.requested_end = episode.start_position, episode.goal_position
                assert sim.pathfinder.find_path(path)
                assert path.geodesic_distance == pytest.approx(episode.geodesic_distance, rel=1e-4)
    # The file beside the scan is read, not written again.
    before = scan.with_suffix(".navmesh").stat().st_mtime_ns
    pack_tool.make_of_scans(tmp_path / "again", [scan, scan], 3, 3)
    assert "from the Gaussians" not in capsys.readouterr().out
    assert scan.with_suffix(".navmesh").stat().st_mtime_ns == before
    split = tmp_path / "again/data/datasets/pointnav/habitat-test-scenes/v1/val/val.json.gz"
    assert [e.id for e in gsnav.io.load_episodes(split)[0]] == ["0", "1", "2"]


def run(tool, monkeypatch, *arguments):
    """Text with which the program ends."""
    monkeypatch.setattr(sys, "argv", ["make_habitat_pack.py", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        tool.main()
    return ended.value.code


@pytest.mark.parametrize("option", ["--train", "--others"])
@pytest.mark.parametrize("value", ["0", "-1", "1.5", "many", "1" + 9 * "0"])
def test_numbers_of_episodes_out_of_range_write_nothing(pack_tool, tmp_path, monkeypatch, capsys, option, value):
    assert run(pack_tool, monkeypatch, tmp_path / "pack", f"{option}={value}") == 2
    assert capsys.readouterr().err.splitlines()[-1].endswith(f"{option}: {value}: must be a number from 1 to 999999999")
    assert not list(tmp_path.iterdir())


def test_folders_that_cannot_be_written_and_scans_that_do_not_exist(pack_tool, tmp_path, monkeypatch):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    for folder in (taken, taken / "below", "/proc/none", "/dev/null"):
        said = run(pack_tool, monkeypatch, folder)
        assert said.startswith("make_habitat_pack.py: ") and str(folder) in said and "\n" not in said
    assert taken.read_text() == "mine"
    for none in (tmp_path / "none.ply", "default"):  # gsnav can open the second, which is no file.
        said = run(pack_tool, monkeypatch, tmp_path / "pack", none)
        assert said == f"make_habitat_pack.py: {none}: no such file" and not (tmp_path / "pack").exists()


def test_an_error_leaves_the_files_of_before(pack_tool, tmp_path, monkeypatch):
    """A write that fails half way, and then one that succeeds."""
    real, written = gsnav.io.save_episodes, []

    def broken(path, rows):
        written.append(os.fspath(path))
        real(path, rows[:1])
        raise OSError(f"{path}: disk full")

    train = tmp_path / "data/datasets/pointnav/habitat-test-scenes/v1/train/train.json.gz"
    arguments = tmp_path, "--train=4", "--others=2"
    monkeypatch.setattr(sys, "argv", ["make_habitat_pack.py", *map(str, arguments)])
    pack_tool.main()
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    monkeypatch.setattr(gsnav.io, "save_episodes", broken)
    assert "disk full" in run(pack_tool, monkeypatch, *arguments)
    assert written and str(train) not in written
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
