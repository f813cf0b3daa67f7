# SPDX-License-Identifier: Apache-2.0
"""tools/make_habitat_pack.py makes episodes in a scan that the simulator opens with the same NavMesh."""

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
