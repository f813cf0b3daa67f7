# SPDX-License-Identifier: Apache-2.0
"""Scenes that are written, against numpy's view of the file and against what the library reads back."""

import copy
import gc

import numpy as np
import pytest

import gsnav

AS_STORED = gsnav.OpenOptions(up="keep", navmesh="none", keep_zero_bands=True)


@pytest.fixture(scope="module")
def cloud(opened):
    return gsnav.open_scene("default", gsnav.OpenOptions(density=0.05, keep_zero_bands=True)).scene.assets[0].cloud


def read_back(path):
    return gsnav.open_scene(path, AS_STORED).scene.assets[0].cloud


def in_reading_order(cloud, values):
    return values[np.argsort(cloud.row_ids)]


def psnr(a, b):
    return -10 * np.log10(np.mean((np.clip(a, 0, 1) - np.clip(b, 0, 1)) ** 2))


def test_arrays_of_a_cloud(cloud, opened):
    n = len(cloud)
    assert n == cloud.size == opened.gaussian_count and cloud.sh_degree in range(4)
    bands = (cloud.sh_degree + 1) ** 2 - 1
    for name, shape, dtype in [("means", (n, 3), "f8"), ("quats", (n, 4), "f4"), ("scales", (n, 3), "f4"),
                               ("opacities", (n,), "f4"), ("sh0", (n, 3), "f4"), ("shN", (n, bands, 3), "f4"),
                               ("row_ids", (n,), "u4")]:
        array = getattr(cloud, name)
        assert array.shape == shape and array.dtype == np.dtype(dtype) and array.flags.writeable, name
    assert np.allclose(np.linalg.norm(cloud.quats, axis=1), 1, atol=1e-6)
    assert np.array_equal(np.sort(cloud.row_ids), np.arange(n))
    bounds = opened.bounds
    assert np.allclose(cloud.means.min(0), bounds.low) and np.allclose(cloud.means.max(0), bounds.high)


def read_ply(path):
    """The rows of a binary PLY file as a function that stacks columns."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    names = [line.split()[-1].decode() for line in header.splitlines() if line.startswith(b"property float ")]
    rows = np.frombuffer(body, np.dtype([(name, "<f4") for name in names]))
    return len(rows), lambda *wanted: np.stack([rows[name] for name in wanted], -1)


def write_ply(path, count, seed):
    """Random Gaussians of SH degree 2. Returns their higher coefficients [count][8][3]."""
    rng = np.random.default_rng(seed)
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", *(f"f_rest_{k}" for k in range(24)), "opacity", "scale_0",
             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    values = rng.normal(size=(count, len(names))).astype("<f4")
    bands = values[:, 6:30]
    bands[rng.uniform(size=bands.shape) < 0.3] = 0
    values[:, 30], values[:, 31:34] = 2, values[:, 31:34] - 3
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
    header += "".join(f"property float {name}\n" for name in names) + "end_header\n"
    path.write_bytes(header.encode() + values.tobytes())
    return bands.reshape(count, 3, 8).transpose(0, 2, 1)


def test_a_ply_file_holds_the_numbers_of_the_cloud(cloud, tmp_path):
    path = tmp_path / "flat.ply"
    gsnav.io.save_scene(path, cloud)
    count, columns = read_ply(path)
    assert count == len(cloud)
    assert np.array_equal(columns("x", "y", "z"), in_reading_order(cloud, cloud.means).astype("f4"))
    assert np.array_equal(columns("f_dc_0", "f_dc_1", "f_dc_2"), in_reading_order(cloud, cloud.sh0))
    assert np.allclose(np.exp(columns("scale_0", "scale_1", "scale_2")), in_reading_order(cloud, cloud.scales),
                       rtol=2e-6, atol=0)
    assert np.allclose(1 / (1 + np.exp(-columns("opacity")[:, 0].astype("f8"))),
                       in_reading_order(cloud, cloud.opacities), rtol=0, atol=1e-6)
    quats = columns("rot_0", "rot_1", "rot_2", "rot_3")  # of any length
    quats = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    assert np.allclose(quats, in_reading_order(cloud, cloud.quats), atol=1e-6)


def test_higher_bands_of_a_file(tmp_path):
    bands = write_ply(tmp_path / "bands.ply", 3000, 1)
    made = read_back(tmp_path / "bands.ply")
    assert made.sh_degree == 2 and np.array_equal(in_reading_order(made, made.shN), bands)
    gsnav.io.save_scene(tmp_path / "again.ply", made)
    columns = read_ply(tmp_path / "again.ply")[1]
    again = columns(*[f"f_rest_{k}" for k in range(24)]).reshape(-1, 3, 8).transpose(0, 2, 1)
    assert np.array_equal(again, bands)


# Name, and the least PSNR of images of the file.
FORMATS = {"flat.ply": 100, "flat.glb": 30,  # glTF draws in the order of distance
           "flat.spz": 35, "flat.sog": 35, "sog/meta.json": 35,
           "flat.compressed.ply": 35, "flat.splat": 30}


@pytest.mark.parametrize("name", FORMATS)
def test_each_format_is_read_back(cloud, opened, name, tmp_path):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"an older file")
    gsnav.io.check_scene_output(path)
    gsnav.io.save_scene(path, cloud)
    made = read_back(path)
    assert len(made) == len(cloud)
    if not name.endswith(".compressed.ply"):  # whose rows lie along a curve
        assert np.abs(in_reading_order(made, made.means) - in_reading_order(cloud, cloud.means)).max() < 5e-3
    cameras = gsnav.views_around(opened, 2, 64, 48)
    images = [gsnav.Renderer("cpu", gsnav.SimulatorScene(assets=[gsnav.SceneAsset(c)])).render(cameras).rgb
              for c in (cloud, made)]
    assert images[0].std() > 0.1 and psnr(*images) > FORMATS[name]
    left = {p.name for p in path.parent.iterdir()} - {path.name}
    assert not [p for p in left if not p.endswith(".webp")]  # no temporary file


def test_values_that_a_format_cannot_hold_are_counted(tmp_path):
    path = tmp_path / "bands.ply"
    bands = write_ply(path, 3000, 2)
    cloud = read_back(path)
    lost = gsnav.io.count_clamped("bands.splat", cloud)
    assert lost.lost_bands == np.count_nonzero(bands) > 0 and lost.all() >= lost.lost_bands
    assert gsnav.io.count_clamped("bands.ply", cloud).all() == 0
    narrow = gsnav.open_scene(path, gsnav.OpenOptions(storage=gsnav.CloudStorage.compact)).scene.assets[0].cloud
    assert narrow.bytes < cloud.bytes and np.allclose(in_reading_order(narrow, narrow.shN), bands, atol=2e-3)
    assert gsnav.io.count_clamped("bands.splat", narrow).lost_bands == np.count_nonzero(narrow.shN)
    gsnav.io.save_scene(path, narrow)
    assert np.array_equal(read_back(path).shN, narrow.shN)


def test_wrong_outputs_are_named(cloud, tmp_path):
    for call in (gsnav.io.check_scene_output, lambda path: gsnav.io.save_scene(path, cloud)):
        with pytest.raises(gsnav.Unsupported, match=r"flat\.xyz.*\.spz"):
            call(tmp_path / "flat.xyz")
        with pytest.raises(gsnav.FileNotFound, match="nowhere"):
            call(tmp_path / "nowhere" / "flat.ply")
    for wrong in (None, 7, "default"):
        with pytest.raises(TypeError):
            gsnav.io.save_scene(tmp_path / "flat.ply", wrong)
    assert not list(tmp_path.iterdir())


def test_parts_of_scenes_are_shared_and_kept_alive(opened):
    scene = gsnav.SimulatorScene(opened)
    asset = scene.assets[0]
    again = copy.copy(asset)
    assert asset.lod is None and asset.visible is None and len(again.cloud) == len(asset.cloud)
    asset.world_from_asset = gsnav.Similarity(translation=(1, 2, 3), scale=2.0)
    moved = gsnav.SimulatorScene(assets=[asset])
    assert moved.navmesh is None and moved.asset_count == 1 and scene.navmesh is not None
    assert np.array_equal(moved.assets[0].world_from_asset.translation, [1, 2, 3])
    assert np.array_equal(scene.assets[0].world_from_asset.translation, [0, 0, 0])
    means, cloud = asset.cloud.means, asset.cloud
    del scene, asset, again, moved
    gc.collect()
    assert np.array_equal(cloud.means, means)
    with pytest.raises(TypeError):
        gsnav.SceneAsset(None)
    camera = gsnav.Camera.look_at((0, 0, 0), (1, 0, 0), (0, 1, 0), 8, 8, 90)
    assert not gsnav.Renderer("cpu", gsnav.SimulatorScene()).render(camera).rgb.any()
