# SPDX-License-Identifier: Apache-2.0
"""Noise models by their names in the registry."""

from ...registry import registry
from .sensor_noise_model import SensorNoiseModel


@registry.register_noise_model(name="None")
class NoSensorNoiseModel(SensorNoiseModel):
    """Leaves images as they are."""


__all__ = ["NoSensorNoiseModel", "SensorNoiseModel"]
