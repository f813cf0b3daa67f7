# SPDX-License-Identifier: Apache-2.0
import gc
import subprocess

import numpy as np
import pytest

import gsnav


def test_images_have_the_bits_of_the_cpp_tool(opened, tools, tmp_path):
    cameras = gsnav.views_around(opened, 3, 64, 48)
    gsnav.io.save_cameras(tmp_path / "cameras.json", cameras)
    # Writing rounds, so both sides use what they read from the file.
    cameras = gsnav.io.load_cameras(tmp_path / "cameras.json")
    subprocess.run([tools / "gsnav-render", "--scene", "default", "--density", "0.05", "--cameras",
                    tmp_path / "cameras.json", "--width", "64", "--height", "48", "--device", "serial",
                    "--profile", "exact", "--npy", "--out", tmp_path / "views"], check=True, capture_output=True)
    frames = gsnav.Renderer("cpu", opened).render(cameras)
    for name, images in [("rgb", frames.rgb), ("alpha", frames.alpha), ("depth", frames.median_depth)]:
        files = sorted((tmp_path / "views").glob(f"*.{name}.npy"))
        assert len(files) == 3 and np.array_equal(images, [np.load(f) for f in files]), name


def test_shapes_and_devices(opened):
    camera = gsnav.framing_camera(opened, 40, 30)
    options = gsnav.RenderOptions(render=gsnav.RenderConfig(outputs=gsnav.Output.kRgb | gsnav.Output.kExpectedDepth))
    one = gsnav.Renderer("cpu", opened, options).render(camera)
    two = gsnav.Renderer(gsnav.Device.parse("serial"), opened, options).render([camera, camera])
    assert one.rgb.shape == (30, 40, 3) and one.rgb.dtype == np.float32 and one.rgb.flags.writeable
    assert two.rgb.shape == (2, 30, 40, 3) and two.expected_depth.shape == (2, 30, 40)
    assert one.alpha is None and one.median_depth is None
    assert np.array_equal(one.rgb, two.rgb[1]) and np.array_equal(one.expected_depth, two.expected_depth[0])
    assert one.rgb.max() > 0.2 and one.stats[0].gaussians == opened.gaussian_count


def test_dlpack_shares_memory(opened):
    rgb = gsnav.Renderer("cpu", opened).render(gsnav.framing_camera(opened, 16, 16)).rgb
    other = np.from_dlpack(rgb)
    assert other.__array_interface__["data"][0] == rgb.__array_interface__["data"][0]
    assert rgb.__dlpack_device__()[0] == 1


def test_images_outlive_renderer_and_scene():
    scene = gsnav.open_scene("default", gsnav.OpenOptions(density=0.05))
    renderer = gsnav.Renderer("cpu", scene)
    camera = gsnav.framing_camera(scene, 32, 32)
    del scene
    gc.collect()
    rgb = renderer.render(camera).rgb
    kept = rgb.copy()
    again = renderer.render(camera).rgb
    del renderer
    gc.collect()
    assert np.array_equal(rgb, kept) and np.array_equal(again, kept)


def test_camera():
    camera = gsnav.Camera.look_at((1, 2, 3), np.array([1.0, 2.0, 0.0]), [0, 1, 0], 64, 48, 90)
    assert np.allclose(camera.position, [1, 2, 3]) and camera.viewmat.shape == (4, 4)
    assert camera.fx == pytest.approx(32)
    moved = gsnav.Camera(width=64, height=48, viewmat=camera.viewmat)
    assert np.array_equal(moved.viewmat, camera.viewmat)
    camera.viewmat = camera.viewmat[:3]
    for wrong in (np.eye(3), "abc", None, [[1, 2]]):
        with pytest.raises(ValueError, match="viewmat"):
            camera.viewmat = wrong


def test_wrong_cameras_leave_the_renderer_usable(opened):
    renderer = gsnav.Renderer("cpu", opened)
    camera = gsnav.framing_camera(opened, 16, 16)
    for change, words in [({"fx": float("nan")}, "Camera.fx"), ({"width": 0}, "Camera.width"),
                          ({"viewmat": np.full((4, 4), np.nan)[:3]}, "viewmat"), ({"near_plane": -1.0}, "near_plane")]:
        wrong = gsnav.Camera(**{**camera.__getstate__(), **change})
        with pytest.raises(gsnav.InvalidArgument, match=words):
            renderer.render(wrong)
    with pytest.raises(ValueError):
        renderer.render([])
    with pytest.raises(TypeError):
        renderer.render("camera")
    assert renderer.render(camera).rgb.shape == (16, 16, 3)


def test_paths_are_names(tmp_path):
    missing = tmp_path / "none.ply"
    for call in (gsnav.open_scene, gsnav.Env, lambda path: gsnav.VectorEnv(2, path)):
        with pytest.raises(FileNotFoundError, match="none.ply: no such file"):
            call(missing)
    for wrong in (b"x.ply", 7, None):
        with pytest.raises(TypeError, match="name must be a str or an os.PathLike"):
            gsnav.open_scene(wrong)


def test_a_wrong_value_names_class_and_field(opened):
    asset, camera = opened.scene.assets[0], gsnav.Camera()
    for thing, field, wrong, words in [
            (asset, "lod", 7, r"SceneAsset.lod: expected LodTree \| None, got 7"),
            (asset, "visible", "all", r"SceneAsset.visible: expected VisibleSets \| None, got 'all'"),
            (asset, "world_from_asset", None, "SceneAsset.world_from_asset: expected Similarity, got None"),
            (asset, "world_from_asset", [1], r"SceneAsset.world_from_asset: expected Similarity, got \[1\]"),
            (camera, "viewmat", "abcd", r"Camera.viewmat: expected numbers of shape \(4, 4\).*, got 'abcd'"),
            (camera, "viewmat", None, "Camera.viewmat: expected numbers .* got None"),
            (camera, "viewmat", 3.5, "Camera.viewmat: expected numbers .* got 3.5"),
            (camera, "fx", "wide", "Camera.fx: expected float, got 'wide'")]:
        before = repr(getattr(thing, field))
        with pytest.raises(ValueError if field == "viewmat" else TypeError, match=words):
            setattr(thing, field, wrong)
        if field not in ("lod", "visible"):
            assert repr(getattr(thing, field)) == before
    asset.lod = asset.visible = None
    asset.world_from_asset.scale = 2.0
    assert asset.lod is None and asset.visible is None and asset.world_from_asset.scale == 2.0
    asset.world_from_asset = gsnav.Similarity(scale=3.0)
    assert asset.world_from_asset.scale == 3.0
