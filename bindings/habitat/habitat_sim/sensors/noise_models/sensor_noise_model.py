# SPDX-License-Identifier: Apache-2.0
"""Base of noise models."""

from typing import Any


class SensorNoiseModel:
    """Noise of a sensor's images. `registry.register_noise_model` registers a subclass, and a sensor names it in
    `noise_model`, with arguments of its constructor in `noise_model_kwargs`."""

    def __init__(self, **settings: Any) -> None:
        self.__dict__.update(settings)

    @staticmethod
    def is_valid_sensor_type(sensor_type: Any) -> bool:
        """Whether the model suits a sensor."""
        return True

    def apply(self, sensor_observation: Any) -> Any:
        """The image with noise."""
        return sensor_observation

    def __call__(self, sensor_observation: Any) -> Any:
        """The image with noise."""
        return self.apply(sensor_observation)
