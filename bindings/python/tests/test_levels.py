# SPDX-License-Identifier: Apache-2.0
"""Levels of detail and visible sets, against properties that numpy can check and against full images."""

import signal

import numpy as np
import pytest

import gsnav


@pytest.fixture(scope="module")
def scene():
    options = gsnav.OpenOptions(navmesh="auto", density=0.2)
    return gsnav.open_scene("default", options).scene


@pytest.fixture(scope="module")
def cloud(scene):
    return scene.assets[0].cloud


@pytest.fixture(scope="module")
def tree(cloud):
    return gsnav.build_lod("cpu", cloud)


@pytest.fixture(scope="module")
def cells(scene, cloud):
    settings = gsnav.VisibleSettings(cell=1.5, margin=0.75, face=96)
    places = gsnav.navmesh_viewpoints(scene.navmesh, [1.5], settings.spacing())
    return places, gsnav.build_visible_sets("cpu", cloud, places, settings)


def masses(cloud):
    """Opacity times area, averaged over directions."""
    s = cloud.scales.astype("f8") ** 2
    return cloud.opacities * np.sqrt(s[:, 0] * s[:, 1] + s[:, 1] * s[:, 2] + s[:, 0] * s[:, 2])


def with_parts(scene, **parts):
    asset = scene.assets[0]
    for name, value in parts.items():
        setattr(asset, name, value)
    return gsnav.SimulatorScene(scene, assets=[asset])


def psnr(a, b):
    error = np.mean((np.clip(a, 0, 1) - np.clip(b, 0, 1)) ** 2)
    return np.inf if error == 0 else -10 * np.log10(error)


def test_each_level_stands_for_the_whole_cloud(cloud, tree):
    assert tree.leaves == -(-len(cloud) // 256) and tree.level_begin[0] == 0
    counts = np.diff(tree.level_begin)
    assert counts[0] == tree.leaves and counts[-1] == 1 and len(counts) == tree.levels
    assert all(counts[1:] == -(-counts[:-1] // 2))
    all_of_it = masses(cloud)
    centre = (all_of_it[:, None] * cloud.means).sum(0) / all_of_it.sum()
    size = np.ptp(cloud.means, axis=0).max()
    merged, first, before = tree.merged, 0, all_of_it.sum()
    weights, means = masses(merged), merged.means
    for level in range(1, tree.levels):
        last = first + 256 * counts[level]
        own = weights[first:last]
        # Gaussians that cover each other let through what they do together, so some mass goes with each merge.
        assert 0.5 * before < own.sum() <= before * (1 + 1e-5)
        before = own.sum()
        assert np.abs((own[:, None] * means[first:last]).sum(0) / own.sum() - centre).max() < 0.03 * size
        assert (own > 0).sum() <= -(-len(cloud) // 2**level) + 2 * counts[level]
        first = last
    assert first == len(merged)


def test_errors_grow_towards_the_root_and_are_bounded(cloud, tree):
    errors, grains, begin = tree.errors, tree.grains, tree.level_begin
    assert errors.shape == grains.shape == (begin[-1],)
    assert not errors[:tree.leaves].any() and (errors[tree.leaves:] > 0).any() and (grains >= 0).all()
    for level in range(1, tree.levels):
        for node in range(begin[level], begin[level + 1]):
            child = begin[level - 1] + 2 * (node - begin[level])
            assert errors[node] >= errors[child:min(child + 2, begin[level])].max()
    # No Gaussian is farther from its merged one than the cloud is long, standard deviations included.
    assert errors[-1] <= np.linalg.norm(np.ptp(cloud.means, axis=0)) + 2 * cloud.scales.max()


def test_images_of_levels(scene, tree):
    views = gsnav.views_around(gsnav.open_scene("default", gsnav.OpenOptions(density=0.05)), 2, 96, 96)
    with_levels = with_parts(scene, lod=tree)
    truth = [gsnav.eval.oracle_photo("cpu", scene, view, 4).rgb for view in views]
    seen = []
    for pixels in (1e-9, 1.0, 30.0):
        detail = gsnav.DetailChoice(lod=gsnav.LodChoice(pixels=pixels))
        frames = gsnav.Renderer("cpu", with_levels, gsnav.RenderOptions(detail=detail)).render(views)
        seen.append((psnr(frames.rgb, truth), sum(s.visible for s in frames.stats)))
    # Small errors draw the cloud itself. Larger ones draw less, and are farther from the photo.
    assert seen[0][1] > seen[1][1] > seen[2][1] and seen[1][0] > seen[2][0] and seen[0][0] > 25
    with pytest.raises(gsnav.InvalidArgument, match=r"lod: SimulatorScene\.assets\[0\]\.lod is null"):
        gsnav.Renderer("cpu", scene, gsnav.RenderOptions(detail=detail))


def test_trees_are_written_and_read(cloud, tree, opened, tmp_path):
    path = tmp_path / "flat.lod"
    gsnav.io.save_lod(path, tree, cloud)
    again = gsnav.io.load_lod(path, cloud)
    assert np.array_equal(again.errors, tree.errors) and np.array_equal(again.merged.means, tree.merged.means)
    assert np.array_equal(again.merged.sh0, tree.merged.sh0) and again.level_begin == tree.level_begin
    with pytest.raises(gsnav.InvalidArgument, match="flat.lod"):
        gsnav.io.load_lod(path, opened.scene.assets[0].cloud)
    with pytest.raises(gsnav.InvalidArgument, match="flat.lod"):
        gsnav.io.load_lod(path, cloud, gsnav.LodSettings(neighbours=3))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(gsnav.InvalidFile, match="flat.lod"):
        gsnav.io.load_lod(path, cloud)
    with pytest.raises(gsnav.FileNotFound, match="none.lod"):
        gsnav.io.load_lod(tmp_path / "none.lod", cloud)
    with pytest.raises(gsnav.FileNotFound, match="nowhere"):
        gsnav.io.save_lod(tmp_path / "nowhere" / "flat.lod", tree, cloud)


def test_viewpoints_stand_above_the_floor(scene):
    places = gsnav.navmesh_viewpoints(scene.navmesh, [0.5, 1.5], 0.4)
    assert places.dtype == np.float64 and places.shape[1] == 3 and len(places) > 50
    assert all(any(scene.navmesh.is_navigable(p - [0, height, 0], 0.05) for height in (0.5, 1.5)) for p in places)
    for arguments, name in [(([1.5], 0.0), "spacing"), (([], 0.4), "height"), (([np.nan], 0.4), "height")]:
        with pytest.raises(gsnav.InvalidArgument, match=name):
            gsnav.navmesh_viewpoints(scene.navmesh, *arguments)


def test_cells_see_what_images_show(scene, cloud, cells):
    places, sets = cells
    keys = sets.keys
    assert keys.dtype == np.int32 and keys.shape == (sets.cells, 3) and sets.viewpoints == len(places)
    assert {tuple(k) for k in np.floor(places / sets.cell).astype(int)} <= {tuple(k) for k in keys}
    shares = [sets.count_seen_rows(c, len(cloud)) / len(cloud) for c in range(sets.cells)]
    assert 0 < max(shares) <= 1 and np.isclose(np.mean(shares), sets.mean_row_share(len(cloud)))
    assert sets.mean_share() >= sets.mean_row_share(len(cloud)) and sets.mean_row_share(len(cloud)) < 0.9
    options = gsnav.RenderOptions(detail=gsnav.DetailChoice(visible_sets=True))
    full, part = gsnav.Renderer("cpu", scene), gsnav.Renderer("cpu", with_parts(scene, visible=sets), options)
    for i, place in enumerate(places[:: len(places) // 6]):
        camera = gsnav.Camera.look_at(place, place + [np.cos(i), 0, np.sin(i)], (0, 1, 0), 64, 64, 100)
        camera.near_plane, camera.near_sigma = sets.near_plane, sets.near_sigma
        cell = sets.cell_of(camera)
        assert tuple(keys[cell]) == tuple(np.floor(place / sets.cell).astype(int))
        a, b = full.render(camera), part.render(camera)
        assert psnr(a.rgb, b.rgb) > 40
    longer = gsnav.Camera.look_at(place, place + [1, 0, 0], (0, 1, 0), 640, 64, 20)
    assert sets.cell_of(longer) is None
    for wrong in (sets.cells, 2**40):
        with pytest.raises(IndexError, match=f"cell {wrong} of {sets.cells}"):
            sets.count_seen_rows(wrong, len(cloud))


def test_visible_sets_are_written_and_read(cloud, cells, opened, tmp_path):
    path = tmp_path / "flat.vis"
    gsnav.io.save_visible_sets(path, cells[1], cloud)
    again = gsnav.io.load_visible_sets(path, cloud)
    assert np.array_equal(again.keys, cells[1].keys) and again.near_plane == cells[1].near_plane
    assert all(again.count_seen_rows(c, len(cloud)) == cells[1].count_seen_rows(c, len(cloud))
               for c in range(again.cells))
    with pytest.raises(gsnav.InvalidArgument, match="flat.vis"):
        gsnav.io.load_visible_sets(path, opened.scene.assets[0].cloud)
    with pytest.raises(gsnav.FileNotFound, match="none.vis"):
        gsnav.io.load_visible_sets(tmp_path / "none.vis", cloud)


def test_sets_that_gain_nothing_have_no_cells(scene, cloud, cells):
    settings = gsnav.VisibleSettings(face=32, most_share=0.01)
    places = gsnav.navmesh_viewpoints(scene.navmesh, [1.5], settings.spacing())
    refused = gsnav.build_visible_sets("cpu", cloud, places, settings)
    assert refused.cells == 0 and 0.01 < refused.refused_share <= 1
    camera = gsnav.Camera.look_at((2, 1.5, 2), (3, 1.5, 2), (0, 1, 0), 32, 32, 90)
    assert refused.cell_of(camera) is None and cells[1].refused_share == 0


def test_wrong_settings_are_named(scene, cloud):
    with pytest.raises(gsnav.InvalidArgument, match=r"LodSettings\.neighbours = 17"):
        gsnav.build_lod("cpu", cloud, gsnav.LodSettings(neighbours=17))
    build = gsnav.build_visible_sets
    with pytest.raises(gsnav.InvalidArgument, match=r"VisibleSettings\.face = 8"):
        build("cpu", cloud, [(1, 1, 1)], gsnav.VisibleSettings(face=8))
    with pytest.raises(gsnav.InvalidArgument, match="no viewpoint"):
        build("cpu", cloud, np.zeros((0, 3)))
    with pytest.raises(gsnav.InvalidArgument, match="viewpoint 1"):
        build("cpu", cloud, [(1, 1, 1), (np.nan, 0, 0)])
    for wrong in (np.zeros(3), np.zeros((2, 2)), None, "x"):
        with pytest.raises(TypeError):
            build("cpu", cloud, wrong)
    camera = gsnav.Camera.look_at((0, 1, 0), (1, 1, 0), (0, 1, 0), 128, 128, 90)
    for face, served in ((64, 128), (256, 256)):
        settings = gsnav.VisibleSettings(face=face)
        settings.serve(camera)
        assert settings.face == served and settings.spacing() == 0.25


def interrupted(call):
    """The last share of progress of a call that ends by the exception of a signal, which arrives after 0.1 s."""
    shares = [0.0]

    def ring(*arguments):
        raise TimeoutError("the signal")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    try:
        with pytest.raises(TimeoutError, match="the signal"):
            call(shares.append)
        return shares[-1]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def hills(side):
    """Triangles of a square of hills, metres."""
    x, z = np.meshgrid(np.linspace(0, side, 65), np.linspace(0, side, 65), indexing="ij")
    at = np.arange(64)[:, None] * 65 + np.arange(64)
    triangles = np.stack([at, at + 1, at + 65, at + 1, at + 66, at + 65], -1).reshape(-1, 3)
    return np.stack([x, np.sin(x / 5) * np.cos(z / 7), z], -1).reshape(-1, 3), triangles


def test_signals_end_the_builders(scene):
    cloud = gsnav.open_scene("default", gsnav.OpenOptions(density=1.0)).scene.assets[0].cloud
    places = gsnav.navmesh_viewpoints(scene.navmesh, [1.5], 0.1)
    settings = gsnav.VisibleSettings(most_share=1.0)
    assert interrupted(lambda progress: gsnav.build_lod("serial", cloud, progress=progress)) < 1
    assert interrupted(lambda progress: gsnav.build_visible_sets("cpu", cloud, places, settings, gsnav.Similarity(),
                                                                 progress)) < 1
    for tile_size, threads in ((0, 1), (1024, 1), (64, 3)):
        ground = gsnav.NavMeshSettings(cell_size=0.03, tile_size=tile_size)
        assert interrupted(lambda progress: gsnav.NavMesh.build(ground, *hills(80), threads, progress)) < 1


def test_progress(scene, cloud):
    shares = []
    gsnav.build_lod("cpu", cloud, progress=shares.append)
    assert shares == sorted(shares) and 0 < shares[0] and shares[-1] == 1
    shares.clear()
    gsnav.build_visible_sets("cpu", cloud, [(2, 1.5, 2), (3, 1.5, 2)], gsnav.VisibleSettings(face=32),
                             progress=shares.append)
    assert shares == [0.5, 1]

    def wrong(share):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        gsnav.build_lod("cpu", cloud, progress=wrong)
    with pytest.raises(KeyError, match="mine"):
        gsnav.build_visible_sets("cpu", cloud, [(2, 1.5, 2)], progress=wrong)
    assert gsnav.build_lod("cpu", cloud).levels > 2  # the threads still work
