# SPDX-License-Identifier: Apache-2.0
"""Noise of sensors against its formulas, in numpy."""

import habitat_sim
import numpy as np
import pytest
from habitat_sim.utils.settings import make_cfg

gsnav = pytest.importorskip("gsnav")
pytest.importorskip("quaternion")
GREY = np.full((300, 400, 4), 128, np.uint8)


def noisy(name, image, seed=3, **settings):
    np.random.seed(seed)
    return habitat_sim.registry.get_noise_model(name)(**settings)(image)


def test_gaussian_and_speckle_have_their_mean_and_deviation():
    for name, factor in (("GaussianNoiseModel", 1.0), ("SpeckleNoiseModel", 128 / 255)):
        out = noisy(name, GREY, intensity_constant=0.1, mean=0.5, sigma=0.8)
        assert out.dtype == np.uint8 and out.shape == GREY.shape and (out[..., 3] == 128).all()
        moved = (out[..., :3].astype(float) - 128) / 255
        assert moved.mean() == pytest.approx(factor * 0.05, abs=1e-3)
        assert moved.std() == pytest.approx(factor * 0.08, rel=0.01)


def test_poisson_has_the_distribution_of_its_levels():
    image = GREY.copy()
    image[0, :200, 0] = np.arange(200)  # 200 values and 128, which is one of them: 256 levels.
    got = noisy("PoissonNoiseModel", image)[1:, :, :3].ravel()
    want = np.floor(255 * np.random.default_rng(1).poisson(128 / 255 * 256, got.size) / 256 + 0.5)
    assert got.mean() == pytest.approx(want.mean(), abs=0.1) and got.std() == pytest.approx(want.std(), rel=0.005)
    counts = np.stack([np.bincount(x.astype(int), minlength=256) for x in (got, want)])
    common = counts[:, counts.min(0) > 50]
    assert common.shape[1] > 60 and (np.abs(common[0] - common[1]) < 6 * np.sqrt(common.sum(0))).all()


def test_salt_and_pepper_has_the_fractions_asked_for():
    out = noisy("SaltAndPepperNoiseModel", GREY, amount=0.2, s_vs_p=0.25)[..., :3]
    white, black = np.mean(out == 255), np.mean(out == 0)
    # Places are drawn with replacement: 0.05 n draws of white, then 0.15 n of black.
    assert black == pytest.approx(1 - np.exp(-0.15), rel=0.03)
    assert white == pytest.approx((1 - np.exp(-0.05)) * np.exp(-0.15), rel=0.03)
    assert np.mean(out == 128) == pytest.approx(1 - white - black)


def test_redwood_depth_is_quantized():
    wall = np.full((60, 80), 4.0, np.float32)
    out = noisy("RedwoodDepthNoiseModel", wall, noise_multiplier=1.0)
    steps = 281.04 / out.astype(float)
    assert np.allclose(steps, np.round(steps), atol=1e-3) and len(np.unique(np.round(steps))) > 1
    none = noisy("RedwoodDepthNoiseModel", wall, noise_multiplier=0.0)
    assert np.allclose(none, 281.04 / np.round(281.04 / 4.0))


def test_numpy_seeds_the_noise():
    first, again, other = (noisy("GaussianNoiseModel", GREY, seed=s) for s in (1, 1, 2))
    assert (first == again).all() and (first != other).any()


def test_sensors_have_noise_and_the_image_below_it(stage):
    def seen(noise):
        config = make_cfg({"scene": stage, "width": 48, "height": 32, "depth_sensor": True, "seed": 5})
        for spec in config.agents[0].sensor_specifications:
            spec.noise_model = noise.get(spec.uuid, "None")
        np.random.seed(1)
        with habitat_sim.Simulator(config) as sim:
            return sim.reset()

    clean = seen({})
    for name in ("GaussianNoiseModel", "SpeckleNoiseModel", "PoissonNoiseModel", "SaltAndPepperNoiseModel"):
        out = seen({"color_sensor": name})
        moved = out["color_sensor"][..., :3].astype(float) - clean["color_sensor"][..., :3]
        assert np.abs(moved).max() > 3 and abs(np.median(moved)) < 3
        assert (out["depth_sensor"] == clean["depth_sensor"]).all()
    out = seen({"depth_sensor": "RedwoodDepthNoiseModel"})["depth_sensor"]
    moved = np.abs(out - clean["depth_sensor"])
    assert out.shape == (32, 48) and moved.max() > 0 and np.median(moved) < 0.3
    with pytest.raises(ValueError, match="'depth_sensor'.*GaussianNoiseModel"):
        seen({"depth_sensor": "GaussianNoiseModel"})


def test_bad_settings_and_images_are_named():
    with pytest.raises(TypeError, match="SaltAndPepperNoiseModel.*'strength'.*amount"):
        noisy("SaltAndPepperNoiseModel", GREY, strength=1)
    with pytest.raises(gsnav.InvalidArgument, match="noise.sigma"):
        noisy("GaussianNoiseModel", GREY, sigma=-1)
    with pytest.raises(gsnav.InvalidArgument, match="noise.amount"):
        noisy("SaltAndPepperNoiseModel", GREY, amount=2)
    with pytest.raises(ValueError, match=r"\[4\]\[4\].*\[H\]\[W\]\[3\]"):
        noisy("GaussianNoiseModel", GREY[:4, :4, 0])
    with pytest.raises(gsnav.InvalidArgument, match="8 bit"):
        noisy("GaussianNoiseModel", np.zeros((4, 4), np.float32))
    with pytest.raises(gsnav.InvalidArgument, match="float32"):
        noisy("RedwoodDepthNoiseModel", GREY)
    with pytest.raises(TypeError):
        noisy("GaussianNoiseModel", GREY.astype(np.float64))


def test_a_sensor_of_a_simulator_takes_noise():
    sensors = gsnav.rgbd_sensors(16, 24)
    sensors[0].noise = gsnav.NoiseModel(kind=gsnav.NoiseKind.salt_and_pepper, amount=1.0, salt=1.0)
    sensors[0].validate()
    sensors[1].noise = gsnav.NoiseModel(kind=gsnav.NoiseKind.speckle)
    with pytest.raises(gsnav.InvalidArgument, match="noise.kind"):
        sensors[1].validate()
