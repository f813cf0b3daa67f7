# SPDX-License-Identifier: Apache-2.0
"""Specifications of sensors, and sensors on nodes."""

import copy
import enum
from typing import Any

import gsnav_habitat as _shared
from magnum import Color4, Deg, Quaternion, Rad, Vector3

from .scene import SceneNode


class SensorType(enum.IntEnum):
    """Quantity that a sensor measures."""

    NONE = 0
    COLOR = 1
    DEPTH = 2
    NORMAL = 3
    SEMANTIC = 4
    PATH = 5
    GOAL = 6
    FORCE = 7
    TENSOR = 8
    TEXT = 9
    AUDIO = 10
    UNSPECIFIED = -2
    UNKNOWN = -1


class SensorSubType(enum.IntEnum):
    """Projection of a camera."""

    NONE = 0
    PINHOLE = 1
    ORTHOGRAPHIC = 2
    EQUIRECTANGULAR = 3
    FISHEYE = 4
    IMPULSERESPONSE = 5


class FisheyeSensorModelType(enum.IntEnum):
    """Model of a fisheye lens."""

    DOUBLE_SPHERE = 0


# Fields of a sensor's specification that can be changed: poses are read by set_transformation_from_spec, others when an
# image is drawn.
_CHANGEABLE = ("position", "orientation", "clear_color", "noise_model_kwargs")


def _whole(x: Any) -> int:
    if int(x) != x:
        raise TypeError(f"SensorSpec.resolution: {x!r}: must be an integer")
    return int(x)


class SensorSpec(_shared.FullySealed):
    """Fields of all sensors. Lengths in metres, `orientation` in radians about X, then Y, then Z. Most fields of a
    specification that belongs to a sensor cannot be changed; a copy can."""

    def __init__(self) -> None:
        self.uuid = ""
        self.sensor_type: Any = SensorType.UNSPECIFIED
        self.sensor_subtype: Any = SensorSubType.NONE
        self.noise_model = "None"
        self.noise_model_kwargs: Any = {}
        self.gpu2gpu_transfer = False
        self.position, self.orientation = Vector3(0, 1.5, 0), Vector3()

    def __setattr__(self, name: str, value: Any) -> None:
        if "_taken" in self.__dict__ and name not in _CHANGEABLE and hasattr(self, name):
            raise NotImplementedError(_shared.message(f"changing {name} of sensor {self.uuid!r}"))
        if name in ("position", "orientation"):
            value = Vector3(*(float(x) for x in value))
        elif name == "resolution":
            value = [_whole(x) for x in value]
        elif name == "hfov" and isinstance(value, Rad):
            value = Deg(value)
        elif name == "clear_color":
            value = value if isinstance(value, Color4) else Color4(*(float(x) for x in value))
        super().__setattr__(name, value)

    def _take(self) -> "SensorSpec":
        """Makes this the specification of a sensor."""
        self.__dict__["_taken"] = True
        if "resolution" in self.__dict__:
            self.__dict__["resolution"] = tuple(self.__dict__["resolution"])
        return self

    def __getstate__(self) -> Any:
        """Fields of a copy, which belongs to no sensor."""
        made = {name: value for name, value in self.__dict__.items() if name != "_taken"}
        if "resolution" in made:
            made["resolution"] = list(made["resolution"])
        return made

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SensorSpec) and type(self) is type(other) and (
            self.__getstate__() == other.__getstate__()
        )

    __hash__ = None  # type: ignore[assignment]

    def is_visual_sensor_spec(self) -> bool:
        """Whether the sensor makes images."""
        return False


class VisualSensorSpec(SensorSpec):
    """Fields of all cameras. `resolution` is [height, width]; `near` and `far` are in metres. `clear_color` is red,
    green, blue and alpha of colour images where nothing is drawn."""

    def __init__(self) -> None:
        super().__init__()
        self.uuid = "rgba_camera"
        self.sensor_type = SensorType.COLOR
        self.resolution = [128, 128]
        self.near, self.far = 0.01, 1000.0
        self.channels = 4
        self.clear_color = Color4(0, 0, 0, 1)

    def is_visual_sensor_spec(self) -> bool:
        return True


class CameraSensorSpec(VisualSensorSpec):
    """A pinhole or orthographic camera. `hfov` is a number of degrees, a Deg or a Rad."""

    def __init__(self) -> None:
        super().__init__()
        self.sensor_subtype = SensorSubType.PINHOLE
        self.hfov: Any = 90.0
        self.ortho_scale = 0.1


class CubeMapSensorBaseSpec(VisualSensorSpec):
    """Fields of cameras of more than 180 degrees."""


class EquirectangularSensorSpec(CubeMapSensorBaseSpec):
    """A camera of the full sphere."""

    def __init__(self) -> None:
        super().__init__()
        self.sensor_subtype = SensorSubType.EQUIRECTANGULAR


class FisheyeSensorSpec(CubeMapSensorBaseSpec):
    """A fisheye camera. Lengths in pixels; `principal_point_offset` None is the middle of the image."""

    def __init__(self) -> None:
        super().__init__()
        self.sensor_subtype = SensorSubType.FISHEYE
        self.focal_length: Any = None
        self.principal_point_offset: Any = None
        self.sensor_model_type = FisheyeSensorModelType.DOUBLE_SPHERE


class FisheyeSensorDoubleSphereSpec(FisheyeSensorSpec):
    """A fisheye camera of the double sphere model with `alpha` and `xi`."""

    def __init__(self) -> None:
        super().__init__()
        self.alpha, self.xi = 0.59, -0.18


def _euler(angles: Any) -> Quaternion:
    x, y, z = (
        Quaternion.rotation(Rad(a), axis)
        for a, axis in zip(angles, (Vector3.x_axis(), Vector3.y_axis(), Vector3.z_axis()))
    )
    return z * y * x


class Sensor(_shared.FullySealed):
    """A sensor on a node. A sensor of a simulator can be drawn and read."""

    def __init__(self, node: SceneNode, spec: Any) -> None:
        self.node, self._spec = node, spec._take()
        self._image: Any = None
        node.node_sensors[spec.uuid] = self
        self.set_transformation_from_spec()

    @property
    def uuid(self) -> str:
        """Name of the sensor."""
        return self._spec.uuid

    @property
    def object(self) -> SceneNode:
        """The node."""
        return self.node

    scene_node = object

    def specification(self) -> Any:
        """The specification."""
        return self._spec

    @property
    def hfov(self) -> Deg:
        """Horizontal angle of view of a camera. It cannot be changed; make another sensor instead."""
        if not hasattr(self._spec, "hfov"):
            raise AttributeError(f"sensor {self.uuid!r} is no camera with a horizontal angle of view")
        return Deg(float(self._spec.hfov))

    @hfov.setter
    def hfov(self, value: Any) -> None:
        raise NotImplementedError(_shared.message(f"changing hfov of sensor {self.uuid!r}"))

    def set_transformation_from_spec(self) -> None:
        """Puts the node where the specification says, relative to its parent."""
        self.node.translation = self._spec.position
        self.node.rotation = _euler(self._spec.orientation)

    def _simulator(self) -> Any:
        """The simulator that the node belongs to. Raises RuntimeError if there is none, or if it is closed."""
        node = self.node
        while node.parent is not None:
            node = node.parent
        found = node._simulator
        if found is None:
            raise RuntimeError(f"sensor {self.uuid!r} belongs to no simulator")
        found._need_open("the sensors")
        return found

    def draw_observation(self) -> None:
        """Draws the image that get_observation returns. Raises RuntimeError without an open simulator."""
        self._image = self._simulator()._draw([self])[self.uuid]

    def get_observation(self) -> Any:
        """The image that was drawn last; draws it if there is none. Raises as draw_observation."""
        self._simulator()
        if self._image is None:
            self.draw_observation()
        image, self._image = self._image, None
        return image


class SensorFactory:
    """Makes and deletes sensors on nodes."""

    @staticmethod
    def create_sensors(node: SceneNode, specs: Any) -> dict[str, Sensor]:
        """Makes a child of the node for each specification, with a sensor. Returns them by name.

        Raises ValueError for an empty name or one that the node has already.
        """
        there, made = node.subtree_sensors, {}
        for spec in specs:
            if not spec.uuid:
                raise ValueError("SensorSpec.uuid is empty: a sensor needs a name")
            if spec.uuid in there or spec.uuid in made:
                raise ValueError(f"SensorSpec.uuid {spec.uuid!r} is used twice")
            made[spec.uuid] = Sensor(node.create_child(), copy.copy(spec))
        return made

    @staticmethod
    def delete_sensor(sensor: Sensor) -> None:
        """Takes a sensor and its node away."""
        sensor.node.node_sensors.pop(sensor.uuid, None)
        sensor.node.remove()

    @staticmethod
    def delete_subtree_sensor(node: SceneNode, uuid: str) -> None:
        """Takes the sensor of a name below a node away. Raises KeyError if there is none."""
        SensorFactory.delete_sensor(node.subtree_sensors[uuid])


for _name in ("CameraSensor", "EquirectangularSensor", "FisheyeSensor", "VisualSensor", "CubeMapSensorBase",
              "AudioSensor", "AudioSensorSpec", "SensorSuite", "Observation", "ObservationSpaceType"):  # fmt: skip
    globals()[_name] = _shared.unserved("habitat_sim.sensor", _name)
