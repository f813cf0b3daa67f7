# SPDX-License-Identifier: Apache-2.0
"""The error report, against numpy; and the reference renderer, against the closed form of one Gaussian."""

import math
import struct

import numpy as np
import pytest

import gsnav
from gsnav import eval as errors


def one_gaussian(path, opacity, scale, colour):
    """Writes a PLY file with a round Gaussian at the origin."""
    names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1",
             "rot_2", "rot_3"]
    header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + "".join(
        f"property float {n}\n" for n in names) + "end_header\n"
    sh0 = [(c - 0.5) / 0.28209479177387814 for c in colour]
    values = [0, 0, 0, *sh0, math.log(opacity / (1 - opacity)), *[math.log(scale)] * 3, 1, 0, 0, 0]
    path.write_bytes(header.encode() + struct.pack("<14f", *values))


def test_the_reference_is_the_closed_form_of_one_gaussian(tmp_path):
    path = tmp_path / "one.ply"
    one_gaussian(path, 0.7, 0.3, (0.9, 0.5, 0.1))
    scene = gsnav.open_scene(path, gsnav.OpenOptions(up="keep"))
    camera = gsnav.Camera.look_at((0, 0, 4), (0, 0, 0), (0, 1, 0), 33, 33, 60)
    frames = errors.oracle_render("cpu", scene, camera)
    # On the view axis, the image of a ball is a disc. 0.3 px^2 are added to the variance.
    variance = (camera.fx * 0.3 / 4) ** 2 + 0.3
    y, x = np.mgrid[:33, :33] + 0.5
    alpha = 0.7 * np.exp(-0.5 * ((x - camera.cx) ** 2 + (y - camera.cy) ** 2) / variance)
    alpha[alpha < 1 / 255] = 0
    assert frames.rgb.dtype == np.float64 and np.allclose(frames.alpha, alpha, atol=1e-6)
    assert np.allclose(frames.rgb, alpha[..., None] * [0.9, 0.5, 0.1], atol=1e-6)
    seen = alpha > 0
    # Depth is that of the point on the pixel's ray that is nearest to the centre of the ball.
    depth = 4 / (1 + ((x - camera.cx) / camera.fx) ** 2 + ((y - camera.cy) / camera.fy) ** 2)
    assert np.allclose(frames.expected_depth[seen], depth[seen]) and not frames.expected_depth[~seen].any()
    assert np.array_equal(frames.median_depth > 0, alpha > 0.5) and frames.undecided.dtype == np.bool_
    assert frames.counts.gaussians == frames.counts.visible == 1 and frames.counts.evaluations == seen.sum()


def psnr(a, b):
    return -10 * np.log10(np.mean((np.clip(a, 0, 1).astype("f8") - np.clip(b, 0, 1)) ** 2))


@pytest.fixture(scope="module")
def cameras(opened):
    return gsnav.views_around(opened, 2, 64, 48)


@pytest.mark.parametrize("name, least", [("exact", 85), ("fast", 65)])
def test_the_report_is_that_of_numpy(opened, cameras, name, least):
    quality = getattr(gsnav.Quality, name)()
    render = gsnav.RenderConfig(quality=quality, background=(0.2, 0.3, 0.4))
    options = gsnav.RenderOptions(render=render)
    shares = []
    report = errors.error_report("cpu", opened, cameras, options, runs=2, progress=shares.append)
    assert shares == [0.5, 1]
    squares, renderer = [], gsnav.Renderer("cpu", opened, options)
    for view, camera in zip(report.views, cameras):
        got = renderer.render(camera)
        want = errors.oracle_render("serial", opened, camera,
                                    errors.OracleConfig(rules=gsnav.RenderConfig(background=(0.2, 0.3, 0.4))))
        assert view.image.psnr == pytest.approx(psnr(want.rgb, got.rgb), abs=1e-9)
        difference = np.abs(np.clip(want.rgb, 0, 1) - np.clip(got.rgb, 0, 1))
        squares.append(np.mean(difference**2))
        assert view.image.max == difference[~want.undecided].max()
        excluded = want.undecided | want.undecided_depth
        both = (want.alpha > 0.9) & ~excluded & (want.median_depth > 0) & (got.median_depth > 0)
        assert view.depth.max == pytest.approx(np.abs(want.median_depth - got.median_depth)[both].max())
        assert view.milliseconds > 0
    assert report.psnr == pytest.approx(-10 * np.log10(np.mean(squares)))
    assert report.worst_psnr == min(v.image.psnr for v in report.views) > least
    assert report.max_error == max(v.image.max for v in report.views) < 0.02
    assert report.max_depth_error == max(v.depth.max for v in report.views)
    assert f"2 views: PSNR {report.psnr:.1f} dB" in str(report)


def test_levels_are_judged_by_photos(opened, cameras):
    report = errors.error_report("cpu", opened, cameras[:1], runs=1, photo=2)
    truth = errors.oracle_photo("cpu", opened, cameras[0], 2).rgb
    got = gsnav.Renderer("cpu", opened).render(cameras[0]).rgb
    assert report.psnr == pytest.approx(psnr(truth, got), abs=1e-9)
    fine = gsnav.Camera.look_at((0, 0, 0), (1, 0, 0), (0, 1, 0), 128, 96, 60)
    fine.viewmat, fine.near_plane, fine.near_sigma = cameras[0].viewmat, cameras[0].near_plane, cameras[0].near_sigma
    for name in ("fx", "fy", "cx", "cy"):
        setattr(fine, name, 2 * getattr(cameras[0], name))
    samples = errors.oracle_render("cpu", opened, fine).rgb
    assert np.allclose(truth, samples.reshape(48, 2, 64, 2, 3).mean((1, 3)), atol=1e-12)


def test_errors_of_arrays():
    rng = np.random.default_rng(1)
    a, b = rng.uniform(size=(5, 7, 3)), rng.uniform(size=(5, 7, 3)).astype("f4")
    e = errors.image_error(a, b)
    difference = np.abs(a - b)
    assert e.max == difference.max() and e.psnr == pytest.approx(psnr(a, b)) and e.pixels == 35
    assert e.rmse == pytest.approx(np.sqrt(np.mean(difference**2)))
    assert e.over_lsb == (difference.max(-1) > 1 / 255).mean()
    mask = difference.max(-1) > 0.5
    e = errors.image_error(a, b, mask)
    assert e.max == difference[~mask].max() and e.excluded == mask.mean() and e.psnr == pytest.approx(psnr(a, b))
    assert errors.image_error(a[:, ::-1], a[:, ::-1]).psnr == math.inf  # strides
    depth, other = rng.uniform(1, 5, (4, 6)), rng.uniform(1, 5, (4, 6))
    other[0, 0] = 0
    d = errors.depth_error(depth, other, np.ones((4, 6)))
    gaps = np.abs(depth - other).ravel()[1:]
    assert d.max == gaps.max() and d.missing == 1 / 24 and d.pixels == 24
    near = errors.depth_error(depth, other, np.ones((4, 6)), None, errors.DepthErrorOptions(max_range=3.0))
    assert near.pixels == (depth <= 3).sum()


def test_wrong_arguments_are_named(opened, people, cameras, tmp_path):
    image = np.zeros((4, 4, 3))
    for arguments, text in [((image, image[:2]), r"test has shape \(2, 4, 3\): it must be \(4, 4, 3\)"),
                            ((image[0, 0], image[0, 0]), r"reference has shape \(3\)"),
                            ((image, image, np.zeros((2, 2), bool)), r"excluded has shape \(2, 2\)"),
                            ((image[:0], image[:0]), "0 values")]:
        with pytest.raises(gsnav.InvalidArgument, match=text):
            errors.image_error(*arguments)
    for wrong in (image.astype("f2"), image.astype(int), image + 1j, "x", None):
        with pytest.raises(TypeError, match="dtype"):
            errors.image_error(image, wrong)
    with pytest.raises(TypeError, match="excluded has dtype"):
        errors.image_error(image, image, np.zeros((4, 4)))
    with pytest.raises(gsnav.Unsupported, match=r"SimulatorScene\.avatars: 2"):
        errors.oracle_render("cpu", people, cameras[0])
    gsnav.io.save_scene(tmp_path / "flat.ply", opened.scene.assets[0].cloud)
    packed = gsnav.open_scene(tmp_path / "flat.ply", gsnav.OpenOptions(storage=gsnav.CloudStorage.packed))
    with pytest.raises(gsnav.Unsupported, match=r"SimulatorScene\.assets\[0\]\.cloud: none"):
        errors.oracle_render("cpu", packed, cameras[0])
    with pytest.raises(gsnav.Unsupported, match=r"SimulatorScene\.assets: none"):
        errors.oracle_render("cpu", gsnav.SimulatorScene(), cameras[0])
    with pytest.raises(gsnav.InvalidArgument, match="k = 17"):
        errors.oracle_photo("cpu", opened, cameras[0], 17)
    with pytest.raises(gsnav.InvalidArgument, match="k = 0"):
        errors.oracle_photo("cpu", opened, cameras[0], 0)
    with pytest.raises(gsnav.InvalidArgument, match=r"OracleConfig\.crop"):
        errors.oracle_render("cpu", opened, cameras[0], errors.OracleConfig(crop=errors.PixelRect(x0=-1, x1=4, y1=4)))
    with pytest.raises(gsnav.InvalidArgument, match="cameras is empty"):
        errors.error_report("cpu", opened, [])
    with pytest.raises(gsnav.InvalidArgument, match="runs = 0"):
        errors.error_report("cpu", opened, cameras, runs=0)
