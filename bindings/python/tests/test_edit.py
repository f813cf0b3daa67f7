# SPDX-License-Identifier: Apache-2.0
"""Clouds that are edited, against numpy's own arithmetic on their arrays and against images."""

import gc

import numpy as np
import pytest

import gsnav
from test_conversion import in_reading_order, psnr, write_ply


@pytest.fixture(scope="module")
def cloud():
    return gsnav.open_scene("default", gsnav.OpenOptions(density=0.05, navmesh="none")).scene.assets[0].cloud


@pytest.fixture(scope="module")
def bands(tmp_path_factory):
    """3,000 Gaussians of SH degree 2."""
    path = tmp_path_factory.mktemp("edit") / "bands.ply"
    write_ply(path, 3000, 3)
    return gsnav.open_scene(path, gsnav.OpenOptions(up="keep", navmesh="none")).scene.assets[0].cloud


def rotation_matrix(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def test_crop_keeps_what_lies_in_the_box(cloud):
    box = gsnav.Aabb(low=(-1, -10, -2), high=(3, 1.2, 2))
    kept = gsnav.crop(cloud, box)
    means = in_reading_order(cloud, cloud.means)
    inside = ((means >= box.low) & (means <= box.high)).all(1)
    assert 0 < inside.sum() < len(cloud) == len(means)
    assert np.array_equal(in_reading_order(kept, kept.means), means[inside])
    assert np.array_equal(in_reading_order(kept, kept.sh0), in_reading_order(cloud, cloud.sh0)[inside])
    with pytest.raises(gsnav.InvalidArgument, match="crop: no Gaussian is left"):
        gsnav.crop(cloud, gsnav.Aabb(low=(100, 100, 100), high=(101, 101, 101)))


def test_filter_rows_takes_the_rows_of_the_arrays(cloud):
    keep = (cloud.opacities > 0.5) & (cloud.scales.max(1) < 0.05)
    kept = gsnav.filter_rows(cloud, keep)
    assert 0 < len(kept) == keep.sum() < len(cloud)
    order = np.argsort(cloud.row_ids)
    for name in ("means", "quats", "scales", "opacities", "sh0", "shN"):
        assert np.array_equal(in_reading_order(kept, getattr(kept, name)),
                              getattr(cloud, name)[order][keep[order]]), name
    every_other = np.zeros(2 * len(cloud), bool)
    every_other[::2] = keep
    assert np.array_equal(gsnav.filter_rows(cloud, every_other[::2]).means, kept.means)  # a strided view
    for wrong in (keep[:-1], keep.astype("i4"), keep[:, None], np.float32(1), "all", None):
        with pytest.raises(gsnav.InvalidArgument, match=rf"keep must be a bool array of shape \[{len(cloud)}\]"):
            gsnav.filter_rows(cloud, wrong)
    with pytest.raises(gsnav.InvalidArgument, match="filter_rows: no Gaussian is left"):
        gsnav.filter_rows(cloud, np.zeros(len(cloud), bool))


def test_transform_moves_turns_and_scales(bands):
    q = np.array([0.5, -0.1, 0.7, 0.3])
    q /= np.linalg.norm(q)
    by = gsnav.Similarity(rotation=q, translation=(5, -2, 300), scale=2.5)
    moved = gsnav.transform(bands, by)
    truth = 2.5 * in_reading_order(bands, bands.means) @ rotation_matrix(q).T + [5, -2, 300]
    assert np.abs(in_reading_order(moved, moved.means) - truth).max() < 2e-5  # float32 within 64 m of an origin
    assert np.allclose(in_reading_order(moved, moved.scales), 2.5 * in_reading_order(bands, bands.scales), rtol=1e-6)
    back = gsnav.transform(moved, gsnav.Similarity(rotation=q * [1, -1, -1, -1], scale=1 / 2.5))
    turned = in_reading_order(back, back.shN), in_reading_order(bands, bands.shN)
    assert np.abs(turned[0] - turned[1]).max() < 1e-5 and np.abs(moved.shN - bands.shN).max() > 0.1


def test_a_transformed_scene_looks_the_same_from_a_transformed_camera(cloud, bands):
    q = np.array([0.9, 0.2, -0.4, 0.1])
    q /= np.linalg.norm(q)
    turn, move = rotation_matrix(q), np.array([1.0, 2.0, -3.0])
    for c, eye, target in ((cloud, np.array([0.5, 1.4, 0.5]), np.array([3.0, 1.0, -1.0])),
                           (bands, np.array([0.0, 0.0, -6.0]), np.zeros(3))):
        images = []
        for part, at, to, up in ((c, eye, target, np.array([0.0, 1.0, 0.0])),
                                 (gsnav.transform(c, gsnav.Similarity(rotation=q, translation=move)),
                                  turn @ eye + move, turn @ target + move, turn @ [0.0, 1.0, 0.0])):
            camera = gsnav.Camera.look_at(at, to, up, 64, 48, 90)
            scene = gsnav.SimulatorScene(assets=[gsnav.SceneAsset(part)])
            images.append(gsnav.Renderer("cpu", scene).render(camera).rgb)
        assert images[0].std() > 0.05 and psnr(*images) > 60


def test_transform_refuses_what_is_no_similarity(bands):
    nan, big = float("nan"), 1e39
    for wrong in (gsnav.Similarity(rotation=(1, 1, 0, 0)), gsnav.Similarity(scale=0.0), gsnav.Similarity(scale=nan),
                  gsnav.Similarity(translation=(0, nan, 0))):
        with pytest.raises(gsnav.InvalidArgument, match="unit quaternion"):
            gsnav.transform(bands, wrong)
    for wrong in (gsnav.Similarity(scale=big), gsnav.Similarity(translation=(big, 0, 0))):
        with pytest.raises(gsnav.InvalidArgument, match="beyond float32"):
            gsnav.transform(bands, wrong)


def test_limit_sh_degree_drops_the_higher_bands(bands):
    one = gsnav.limit_sh_degree(bands, 1)
    assert one.sh_degree == 1 and one.bytes < bands.bytes and np.array_equal(one.shN, bands.shN[:, :3])
    assert gsnav.limit_sh_degree(bands, 3).sh_degree == 2 and gsnav.limit_sh_degree(bands, 0).shN.size == 0
    for wrong in (-1, 4):
        with pytest.raises(gsnav.InvalidArgument, match=f"degree {wrong}"):
            gsnav.limit_sh_degree(bands, wrong)


def test_append_joins_two_clouds(cloud, bands):
    both = gsnav.append(bands, cloud)
    assert len(both) == len(bands) + len(cloud) and both.sh_degree == max(bands.sh_degree, cloud.sh_degree)
    means = in_reading_order(both, both.means)
    assert np.array_equal(means[:len(bands)], in_reading_order(bands, bands.means))
    assert np.array_equal(means[len(bands):], in_reading_order(cloud, cloud.means))


def test_up_axes(cloud, bands):
    assert np.array_equal(gsnav.guess_up(cloud).up, [0, 1, 0]) and gsnav.guess_up(cloud).seen
    for axis, vector in (("x", (1, 0, 0)), ("-x", (-1, 0, 0)), ("y", (0, 1, 0)), ("-y", (0, -1, 0)),
                         ("+z", (0, 0, 1)), ("-z", (0, 0, -1))):
        assert np.allclose(rotation_matrix(gsnav.upright(axis).rotation) @ vector, [0, 1, 0], atol=1e-15), axis
        lying = gsnav.transform(cloud, gsnav.Similarity(rotation=gsnav.upright(axis).rotation * [1, -1, -1, -1]))
        if axis in ("y", "-y", "+z"):  # the axes that guess_up knows
            assert np.allclose(gsnav.guess_up(lying).up, vector), axis
    with pytest.raises(gsnav.InvalidArgument, match="'up'"):
        gsnav.upright("up")


def test_edits_leave_the_cloud_as_it_was(bands):
    before = {name: getattr(bands, name).copy() for name in ("means", "shN", "row_ids")}
    made = [gsnav.crop(bands, gsnav.Aabb(low=(-9, -9, -9), high=(0, 9, 9))), gsnav.limit_sh_degree(bands, 0),
            gsnav.transform(bands, gsnav.Similarity(scale=2.0))]
    views = [c.means for c in made]
    del made
    gc.collect()
    assert all(np.isfinite(v).all() for v in views)
    for name, values in before.items():
        assert np.array_equal(getattr(bands, name), values), name
