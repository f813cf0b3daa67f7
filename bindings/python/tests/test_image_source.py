# SPDX-License-Identifier: Apache-2.0
"""A batch draws into memory that a function gives."""

import array
import gc
import weakref

import numpy as np
import pytest

import gsnav

N = 3


@pytest.fixture
def make(opened):
    episodes = gsnav.generate_episodes(opened.scene.navmesh, 16, 1)
    config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(8, 12), task=gsnav.TaskConfig(max_steps=5))

    def batch(source=None):
        return gsnav.BatchSimulator("cpu", [opened.scene], config, N, lambda e, k: episodes[(e + 5 * k) % 16],
                                    image_source=source)

    return batch


def test_images_are_kept_without_a_copy(make):
    rows = {0: np.full((9, N, 8, 12, 3), -1, np.float32), 1: np.full((9, N, 8, 12, 1), -1, np.float32)}
    at = 0
    asked = []

    def source(sensor, floats):
        asked.append((sensor, floats))
        return rows[sensor][at]

    given, plain = make(source), make()
    steps = [given.reset(), plain.reset()]
    expected = []
    for at in range(1, 9):
        expected.append({name: image.copy() for name, image in steps[1].images.items()})
        assert all(np.shares_memory(steps[0].images[name], rows[k]) for k, name in enumerate(("rgb", "depth")))
        steps = [sim.step([at % 3 + 1] * N) for sim in (given, plain)]
    assert asked[:2] == [(0, N * 8 * 12 * 3), (1, N * 8 * 12)]
    for k, images in enumerate(expected):
        assert np.array_equal(rows[0][k], images["rgb"]) and np.array_equal(rows[1][k], images["depth"])


def test_an_image_keeps_its_memory_alive(make):
    sim = make(lambda sensor, floats: np.zeros(floats, np.float32))
    image = sim.reset().images["rgb"]
    expected = image.copy()
    for _ in range(3):
        sim.step([2] * N)
    del sim
    gc.collect()
    assert np.array_equal(image, expected)


def read_only(floats):
    array = np.zeros(floats, np.float32)
    array.flags.writeable = False
    return array


def unaligned(floats):
    return np.zeros(4 * floats + 1, np.uint8)[1:].view(np.float32)


@pytest.mark.parametrize("wrong, error, message", [
    (lambda f: np.zeros(f), gsnav.InvalidArgument, "float32"),
    (lambda f: np.zeros(2 * f, np.float32)[::2], gsnav.InvalidArgument, "contiguous"),
    (read_only, gsnav.InvalidArgument, "writable"),
    (lambda f: np.zeros(f - 1, np.float32), gsnav.InvalidArgument, r'floats for the sensor "rgb", which needs'),
    (unaligned, gsnav.InvalidArgument, r'the sensor "rgb" is not aligned to 4 bytes'),
    (lambda f: None, gsnav.InvalidArgument, "returned NoneType"),
    (lambda f: 1 // 0, ZeroDivisionError, "division"),
])
def test_wrong_memory_is_refused_before_an_environment_moves(make, wrong, error, message):
    good = True
    sim = make(lambda sensor, floats: np.zeros(floats, np.float32) if good else wrong(floats))
    sim.reset()
    before = sim.world(0).time
    good = False
    with pytest.raises(error, match=message):
        sim.step([1] * N)
    good = True
    assert sim.world(0).time == before
    sim.reset()


def test_the_source_must_be_callable(make):
    with pytest.raises(TypeError, match="image_source must be callable or None, got int"):
        make(3)


def test_memory_lives_as_long_as_its_export(make):
    freed, owned = [], []

    class Lazy:
        """Exports an array that nothing else owns."""

        def __init__(self, floats):
            self.floats = floats

        def __dlpack__(self, **settings):
            array = np.full(self.floats, 7, np.float32)
            weakref.finalize(array, freed.append, self.floats)
            return array.__dlpack__()

        def __dlpack_device__(self):
            return 1, 0

    batch = make(lambda sensor, floats: Lazy(floats))
    seen = batch.reset()
    gc.collect()
    assert not freed and not (seen.images["rgb"] == 7).all()

    def source(sensor, floats):
        owned.append(array.array("f", bytes(4 * floats)))
        return owned[-1]

    batch = make(source)
    seen = batch.reset()
    with pytest.raises(BufferError):
        del owned[0][:]
    assert seen.images["rgb"].any()
