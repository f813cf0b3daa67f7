# SPDX-License-Identifier: Apache-2.0
"""Settings of a simulator with one agent as a flat dict."""

from typing import Any

import gsnav_habitat as _shared

from .. import agent as _agent
from .. import nav
from ..sensor import (
    CameraSensorSpec,
    EquirectangularSensorSpec,
    FisheyeSensorDoubleSphereSpec,
    SensorSubType,
    SensorType,
)
from ..simulator import Configuration, SimulatorConfiguration

default_sim_settings: dict[str, Any] = {
    "scene": "NONE",
    "scene_dataset_config_file": "default",
    "default_agent": 0,
    "agent_height": 1.5,
    "agent_radius": 0.1,
    "sensor_height": 1.5,
    "width": 640,
    "height": 480,
    "hfov": 90,
    "zfar": 1000.0,
    "color_sensor": True,
    "semantic_sensor": False,
    "depth_sensor": False,
    "ortho_rgba_sensor": False,
    "ortho_depth_sensor": False,
    "ortho_semantic_sensor": False,
    "fisheye_rgba_sensor": False,
    "fisheye_depth_sensor": False,
    "fisheye_semantic_sensor": False,
    "equirect_rgba_sensor": False,
    "equirect_depth_sensor": False,
    "equirect_semantic_sensor": False,
    "seed": 1,
    "physics_config_file": "data/default.physics_config.json",
    "enable_physics": False,
    "default_agent_navmesh": True,
    "navmesh_include_static_objects": False,
    "enable_hbao": False,
    "gpu_device_id": 0,
    "allow_sliding": True,
    "frustum_culling": True,
    "max_frames": 1000,
    "silent": False,
}

# Setting, name of the sensor, its quantity and its specification.
_SENSORS = [
    (f"{shape}{kind}_sensor", f"{shape}{kind}_sensor", quantity, make, subtype)
    for shape, make, subtype in (
        ("", CameraSensorSpec, SensorSubType.PINHOLE),
        ("ortho_", CameraSensorSpec, SensorSubType.ORTHOGRAPHIC),
        ("fisheye_", FisheyeSensorDoubleSphereSpec, SensorSubType.FISHEYE),
        ("equirect_", EquirectangularSensorSpec, SensorSubType.EQUIRECTANGULAR),
    )
    for kind, quantity in (
        ("color" if not shape else "rgba", SensorType.COLOR),
        ("depth", SensorType.DEPTH),
        ("semantic", SensorType.SEMANTIC),
    )
]


def make_cfg(settings: dict[str, Any]) -> Configuration:
    """A Configuration of these settings; those that are missing have their defaults."""
    s = {**default_sim_settings, **settings}
    sim = SimulatorConfiguration()
    sim.scene_id, sim.random_seed, sim.default_agent_id = s["scene"], s["seed"], s["default_agent"]
    for name in ("scene_dataset_config_file", "gpu_device_id", "allow_sliding", "frustum_culling", "enable_physics",
                 "enable_hbao", "physics_config_file"):  # fmt: skip
        setattr(sim, name, s[name])
    if s["default_agent_navmesh"]:
        sim.navmesh_settings = nav.NavMeshSettings()
        sim.navmesh_settings.agent_radius, sim.navmesh_settings.agent_height = s["agent_radius"], s["agent_height"]
        sim.navmesh_settings.include_static_objects = s["navmesh_include_static_objects"]
    agent = _agent.AgentConfiguration(height=s["agent_height"], radius=s["agent_radius"], sensor_specifications=[])
    for setting, uuid, quantity, make, subtype in _SENSORS:
        if not s[setting]:
            continue
        spec = make()
        spec.uuid, spec.sensor_type, spec.sensor_subtype = uuid, quantity, subtype
        spec.resolution, spec.position = [s["height"], s["width"]], [0.0, s["sensor_height"], 0.0]
        spec.far = s["zfar"]
        if hasattr(spec, "hfov"):
            spec.hfov = s["hfov"]
        agent.sensor_specifications.append(spec)
    return Configuration(sim, [agent])


_shared.complete(__name__)
