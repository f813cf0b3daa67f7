# SPDX-License-Identifier: Apache-2.0
"""Draws the images of sensors with gsnav.FreeSensors."""

import dataclasses
import functools
import math
from typing import Any

import numpy as np

import gsnav_habitat as _shared
from gsnav_habitat import _turns

from . import _engine
from .registry import registry
from .sensor import (
    CameraSensorSpec,
    EquirectangularSensorSpec,
    FisheyeSensorDoubleSphereSpec,
    FisheyeSensorModelType,
    SensorSubType,
    SensorType,
)

_KINDS = {SensorType.COLOR: "rgb", SensorType.DEPTH: "depth", SensorType.SEMANTIC: "depth"}
_MODELS = {
    SensorSubType.PINHOLE: ("pinhole", CameraSensorSpec),
    SensorSubType.EQUIRECTANGULAR: ("equirectangular", EquirectangularSensorSpec),
    SensorSubType.FISHEYE: ("fisheye", FisheyeSensorDoubleSphereSpec),
}
_NO_NOISE = ("None", "", None)
_BLACK = (0.0, 0.0, 0.0)
_CONVERTERS = 8  # Threads of the CPU that turn images from a GPU into arrays.


def check(spec: Any, empty: bool) -> None:
    """Raises NotImplementedError for a sensor that gsnav does not serve, in the empty scene or in others, and
    ValueError for a value out of range."""
    what = f"sensor {spec.uuid!r}"
    if spec.sensor_type not in _KINDS:
        raise NotImplementedError(_shared.message(f"{what} with sensor_type {spec.sensor_type!r}"))
    kind = _MODELS.get(spec.sensor_subtype)
    if kind is None or not isinstance(spec, kind[1]):
        raise NotImplementedError(
            _shared.message(f"{what} of type {type(spec).__name__} with sensor_subtype {spec.sensor_subtype!r}")
        )
    if spec.noise_model not in _NO_NOISE:
        noise = registry.get_noise_model(spec.noise_model)
        if noise is None:
            raise NotImplementedError(_shared.message(f"{what} with noise_model {spec.noise_model!r}"))
        if not noise.is_valid_sensor_type(spec.sensor_type):
            raise ValueError(f"{what}: noise_model = {spec.noise_model!r} is not for {spec.sensor_type!r}")
        try:
            noise(**dict(spec.noise_model_kwargs))
        except (TypeError, ValueError) as error:
            kind = TypeError if isinstance(error, TypeError) else ValueError
            raise kind(f"{what}: noise_model_kwargs = {dict(spec.noise_model_kwargs)}: {error}") from error
    if spec.gpu2gpu_transfer:
        raise NotImplementedError(_shared.message(f"{what} with gpu2gpu_transfer"))
    if len(spec.resolution) != 2 or min(spec.resolution) < 1:
        raise ValueError(f"{what}: resolution = {spec.resolution}: must be [height, width], each at least 1")
    for name in ("position", "orientation"):
        if not all(map(math.isfinite, getattr(spec, name))):
            raise ValueError(f"{what}: {name} = {getattr(spec, name)}: must be finite")
    if spec.sensor_type == SensorType.COLOR:
        _background(spec, empty)
    _native(spec).validate()


def _background(spec: Any, empty: bool = False) -> tuple[float, ...]:
    """Colour of a sensor where nothing is drawn, red, green and blue in [0, 1]. Raises the errors of check."""
    what, color = f"sensor {spec.uuid!r}", tuple(spec.clear_color)
    if not all(map(math.isfinite, color)):
        raise ValueError(f"{what}: clear_color = {spec.clear_color}: must be finite")
    made = tuple(min(max(c, 0.0), 1.0) for c in color[:3])
    if not empty and color[3] < 1:
        raise NotImplementedError(_shared.message(f"{what} with clear_color = {spec.clear_color}, alpha is not 1"))
    if not empty and spec.sensor_subtype == SensorSubType.FISHEYE and made != _BLACK:  # So is what no lens sees.
        raise NotImplementedError(_shared.message(f"{what}, a fisheye, with clear_color = {spec.clear_color}"))
    return made


def _number(spec: Any, name: str) -> float:
    value = getattr(spec, name)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"sensor {spec.uuid!r}: {name} = {value!r}: must be a number") from None


def _native(spec: Any) -> Any:
    """The gsnav.SensorSpec of a sensor. Its pose is given at each render. A semantic sensor becomes one of depth, whose
    other fields have the same ranges."""
    gsnav = _engine.library()
    made = gsnav.SensorSpec(
        uuid=spec.uuid,
        kind=getattr(gsnav.SensorKind, _KINDS[spec.sensor_type]),
        model=getattr(gsnav.SensorModel, _MODELS[spec.sensor_subtype][0]),
        resolution=spec.resolution,
        near_plane=_number(spec, "near"),
        far_plane=_number(spec, "far"),
    )
    if hasattr(spec, "hfov"):
        made.hfov = _number(spec, "hfov")
    if spec.sensor_subtype == SensorSubType.FISHEYE:
        if spec.sensor_model_type != FisheyeSensorModelType.DOUBLE_SPHERE:
            raise ValueError(
                f"sensor {spec.uuid!r}: sensor_model_type = {spec.sensor_model_type!r}: must be DOUBLE_SPHERE"
            )
        lens = gsnav.FisheyeLens(alpha=float(spec.alpha), xi=float(spec.xi))
        if spec.focal_length is not None:
            lens.focal_length = [float(f) for f in spec.focal_length]
        if spec.principal_point_offset is not None:
            lens.principal_point_offset = [float(f) for f in spec.principal_point_offset]
        made.fisheye = lens
    return made


@dataclasses.dataclass
class _Group:
    """Sensors that are drawn over one colour."""

    background: tuple[float, ...]
    sensors: list[Any]
    natives: list[Any]  # Their specifications.
    key: str


def _groups(sensors: list[Any]) -> list[_Group]:
    """Sensors by the colours behind them. Those without colours join the first ones."""
    colors = [_background(s.specification()) if _is_color(s) else None for s in sensors]
    first = next((c for c in colors if c is not None), _BLACK)
    backgrounds, made = [first if c is None else c for c in colors], []
    for color in dict.fromkeys(backgrounds):
        members = [s for s, c in zip(sensors, backgrounds) if c == color]
        natives = [_native(s.specification()) for s in members]
        made.append(_Group(color, members, natives, repr((color, natives))))
    return made


class Painter:
    """Draws one stage on one device."""

    def __init__(self, stage: Any, device: Any) -> None:
        self._stage, self._device = stage, device
        self._together = _together(device)
        self._drawn: Any = None  # Sensors and their clear colours.
        self._groups: list[_Group] = []

    def of(self, stage: Any) -> "Painter":
        """A painter of another stage, on the same device."""
        return Painter(stage, self._device)

    def draw(self, sensors: Any, seconds: float) -> dict[str, np.ndarray]:
        """New arrays by the names of the sensors, at a time on the scene's clock: colour uint8 [height][width][4],
        depth float32 [height][width] in metres with 0 for no return, semantic uint32 [height][width]."""
        drawn, images = [], {}
        for sensor in sensors:
            spec = sensor.specification()
            if spec.sensor_type == SensorType.SEMANTIC:  # The scene has no labels: 0 is "none".
                images[sensor.uuid] = np.zeros(tuple(spec.resolution), np.uint32)
            elif self._stage.scene is None:
                images[sensor.uuid] = _nothing(spec)
            else:
                drawn.append(sensor)
        if drawn:
            now = drawn, [s._spec.clear_color._v.tobytes() for s in drawn]
            if self._drawn != now:
                self._groups, self._drawn = _groups(drawn), now
            for group in self._groups:
                images.update(self._draw_group(group, seconds))
        return {s.uuid: _noisy(images[s.uuid], s.specification()) for s in sensors}

    def _draw_group(self, group: _Group, seconds: float) -> dict[str, np.ndarray]:
        poses = [_pose(s) for s in group.sensors]
        if not self._together:
            return _turns.draw_alone(functools.partial(self._draw_place, group, seconds, poses))
        # Time matters among people only.
        key = self._stage, group.key, self._device.index, seconds if self._stage.scene.avatar_count else 0.0
        return _turns.draw_together(key, poses, functools.partial(self._draw_places, group, seconds))

    def _draw_place(self, group: _Group, seconds: float, poses: list[Any]) -> dict[str, np.ndarray]:
        """Images at the poses of one environment."""
        with self._stage.drawer(self._device, group.key, group.natives, group.background) as drawer:
            return dict(drawer.render(poses, seconds))

    def _draw_places(self, group: _Group, seconds: float, places: list[Any]) -> list[dict[str, np.ndarray]]:
        """Images at the poses of each environment, drawn in one call."""
        with self._stage.drawer(self._device, group.key, group.natives, group.background) as drawer:
            return drawer.render_places(places, seconds, min(_engine.threads(), _CONVERTERS))


def _is_color(sensor: Any) -> bool:
    return bool(sensor.specification().sensor_type == SensorType.COLOR)


def _together(device: Any) -> bool:
    """Whether images of several environments are drawn in one call."""
    return bool(device.kind == _engine.library().DeviceKind.cuda)


def _pose(sensor: Any) -> Any:
    position, rotation = sensor.node._in_world()
    x, y, z, w = rotation._q
    return list(position._v), [w, x, y, z]


def _nothing(spec: Any) -> np.ndarray:
    shape = tuple(spec.resolution)
    if spec.sensor_type == SensorType.DEPTH:
        return np.zeros(shape, np.float32)
    out = np.empty((*shape, 4), np.uint8)
    out[...] = _engine.library().to_bytes(np.array(spec.clear_color, np.float32))
    return out


def _noisy(image: np.ndarray, spec: Any) -> np.ndarray:
    if spec.noise_model in _NO_NOISE:
        return image
    return registry.get_noise_model(spec.noise_model)(**dict(spec.noise_model_kwargs))(image)
