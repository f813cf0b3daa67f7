# SPDX-License-Identifier: Apache-2.0
"""Noise models by their names in the registry. Their formulas are those of gsnav.with_noise."""

from typing import Any

import numpy as np

from ...registry import registry
from ...sensor import SensorType
from .sensor_noise_model import SensorNoiseModel


@registry.register_noise_model(name="None")
class NoSensorNoiseModel(SensorNoiseModel):
    """Leaves images as they are."""


class _LibraryNoise(SensorNoiseModel):
    """Noise of a kind of gsnav.NoiseKind. The seed of each image is drawn from numpy.random."""

    _kind = ""
    _type = SensorType.COLOR
    _fields: dict[str, str] = {}  # Settings of the constructor, and their names in gsnav.NoiseModel.

    def __init__(self, **settings: Any) -> None:
        import gsnav

        for name in settings:
            if name not in self._fields and name != "gpu_device_id":
                raise TypeError(f"{type(self).__name__}: unknown setting {name!r}; it has {sorted(self._fields)}")
        super().__init__(**settings)
        given = {self._fields[k]: float(v) for k, v in settings.items() if k in self._fields}
        self._model = gsnav.NoiseModel(kind=getattr(gsnav.NoiseKind, self._kind), **given)

    @classmethod
    def is_valid_sensor_type(cls, sensor_type: Any) -> bool:
        """Whether the model suits a sensor."""
        return bool(sensor_type == cls._type)

    def apply(self, sensor_observation: Any) -> Any:
        """A copy of the image with noise: colours uint8 [H][W][3 or 4], depth float32 [H][W] in metres."""
        import gsnav

        seed = int(np.random.randint(0, 2**63, dtype=np.int64))
        return gsnav.with_noise(self._model, seed, np.ascontiguousarray(sensor_observation))


_SCALE = {"intensity_constant": "intensity", "mean": "mean", "sigma": "sigma"}


@registry.register_noise_model
class GaussianNoiseModel(_LibraryNoise):
    """Gaussian noise: `intensity_constant` 0.2, `mean` 0, `sigma` 1."""

    _kind, _fields = "gaussian", _SCALE


@registry.register_noise_model
class SpeckleNoiseModel(_LibraryNoise):
    """Gaussian noise in proportion to the colour: `intensity_constant` 0.2, `mean` 0, `sigma` 1."""

    _kind, _fields = "speckle", _SCALE


@registry.register_noise_model
class PoissonNoiseModel(_LibraryNoise):
    """Shot noise."""

    _kind = "poisson"


@registry.register_noise_model
class SaltAndPepperNoiseModel(_LibraryNoise):
    """White and black values: `amount` 0.05 of all, of which `s_vs_p` 0.5 are white."""

    _kind, _fields = "salt_and_pepper", {"amount": "amount", "s_vs_p": "salt"}


@registry.register_noise_model
class RedwoodDepthNoiseModel(_LibraryNoise):
    """Noise of a structured-light camera, `noise_multiplier` 1. The distortion of that camera is left out."""

    _kind, _type, _fields = "redwood_depth", SensorType.DEPTH, {"noise_multiplier": "multiplier"}


__all__ = [
    "GaussianNoiseModel", "NoSensorNoiseModel", "PoissonNoiseModel", "RedwoodDepthNoiseModel",
    "SaltAndPepperNoiseModel", "SensorNoiseModel", "SpeckleNoiseModel",
]  # fmt: skip
