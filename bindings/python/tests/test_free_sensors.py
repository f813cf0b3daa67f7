# SPDX-License-Identifier: Apache-2.0
"""gsnav.FreeSensors at many places in one call."""

import gsnav
import numpy as np
import pytest

SENSORS = [
    gsnav.SensorSpec(uuid="rgb", kind=gsnav.SensorKind.rgb, resolution=[12, 16]),
    gsnav.SensorSpec(uuid="depth", kind=gsnav.SensorKind.depth, resolution=[12, 16]),
    gsnav.SensorSpec(uuid="alpha", kind=gsnav.SensorKind.alpha, resolution=[8, 8]),
]
POSITION = [4.6, 1.5, 3.6]


def place(x, yaw):
    pose = [POSITION[0] - x, *POSITION[1:]], [np.cos(yaw / 2), 0, np.sin(yaw / 2), 0]
    return [pose] * len(SENSORS)


def equal(a, b):
    return a.keys() == b.keys() and all(np.array_equal(a[k], b[k]) for k in a)


@pytest.mark.parametrize("threads", [1, 3, 50])
def test_many_places_have_the_images_of_each(opened, threads):
    sensors = gsnav.FreeSensors("cpu:2", opened, SENSORS)
    places = [place(0.3 * i, 0.4 * i) for i in range(5)]
    together = sensors.render_places(places, threads=threads)
    alone = [sensors.render(p) for p in places]
    assert len(together) == 5 and all(map(equal, together, alone))
    assert not np.array_equal(together[0]["rgb"], together[4]["rgb"])
    kinds = {name: (image.shape, image.dtype) for name, image in together[1].items()}
    assert kinds == {"rgb": ((12, 16, 4), np.uint8), "depth": ((12, 16), np.float32), "alpha": ((8, 8), np.float32)}
    assert sensors.render_places([]) == []


def test_wrong_places_name_the_sensor(opened):
    sensors = gsnav.FreeSensors("serial", opened, SENSORS)
    with pytest.raises(gsnav.InvalidArgument, match="2 poses for 3 sensors"):
        sensors.render_places([place(0, 0), place(0, 0)[:2]])
    wrong = place(0, 0)
    wrong[1] = [float("nan"), 0, 0], wrong[1][1]
    with pytest.raises(gsnav.InvalidArgument, match="depth"):
        sensors.render_places([place(0, 0), wrong])
    assert len(sensors.render_places([place(0, 0)])) == 1


def test_images_do_not_depend_on_the_other_sensors(opened):
    every = gsnav.FreeSensors("cpu:1", opened, SENSORS).render(place(0, 0.5))
    one = gsnav.FreeSensors("cpu:1", opened, SENSORS[:1])
    for sensor in SENSORS:  # Only the images that sensors show are drawn.
        one.set_sensors([sensor])
        assert np.array_equal(one.render(place(0, 0.5)[:1])[sensor.uuid], every[sensor.uuid])


def test_images_belong_to_the_caller_and_dead_memory_is_used_again(opened):
    sensors = gsnav.FreeSensors("cpu:1", opened, SENSORS)
    first = sensors.render(place(0, 0))
    kept = {name: image.copy() for name, image in first.items()}
    view = first["rgb"][..., :3]
    for i in range(4):
        sensors.render(place(0.2 * i, 0.5))
        assert equal(first, kept)
    del first
    sensors.set_sensors(SENSORS[:1])
    other = sensors.render(place(0.2, 0.5)[:1])["rgb"]
    assert np.array_equal(view, kept["rgb"][..., :3]) and not np.shares_memory(view, other)
    del sensors  # Images outlive their sensors.
    assert np.array_equal(view, kept["rgb"][..., :3])
    other[...] = 7  # They can be written.


@pytest.mark.parametrize("part", [np.s_[:, :, :3], np.s_[::-1, 1::2, :3], np.s_[:, :, 2::-1], np.s_[:0, :, :3]])
def test_packed_colours_are_a_contiguous_copy(part):
    image = np.random.default_rng(1).integers(0, 256, (9, 14, 4), np.uint8)[part]
    packed = gsnav.FreeSensors.packed(image)
    assert np.array_equal(packed, image) and packed.flags.c_contiguous and not np.shares_memory(packed, image)
    image.flags.writeable = False
    assert np.array_equal(gsnav.FreeSensors.packed(image), image)


@pytest.mark.parametrize("wrong", [np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4, 3), np.int8),
                                   np.zeros((4, 3), np.uint8), [[[1, 2, 3]]], None])
def test_packed_takes_colours_only(wrong):
    with pytest.raises(TypeError):
        gsnav.FreeSensors.packed(wrong)


def test_the_background_shows_by_the_share_that_nothing_covers(opened):
    sensors = gsnav.FreeSensors("cpu:1", opened, [SENSORS[0], SENSORS[2]])
    outside = [([-3.0, 4.0, 3.0], [np.sqrt(0.5), 0, -np.sqrt(0.5), 0])] * 2
    black = sensors.render(outside)
    sensors.set_background([1, 0.5, 0])
    colored = sensors.render(outside)
    assert np.array_equal(black["alpha"], colored["alpha"])
    added = colored["rgb"][..., :3].astype(int) - black["rgb"][..., :3]
    empty = added[..., 0] == 255
    assert empty.any() and not empty.all() and (added[empty] == [255, 128, 0]).all() and not added[..., 2].any()
    with pytest.raises(gsnav.InvalidArgument, match="background"):
        sensors.set_background([0, np.nan, 0])
    assert np.array_equal(sensors.render(outside)["rgb"], colored["rgb"])
