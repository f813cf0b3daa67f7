# SPDX-License-Identifier: Apache-2.0
"""Navigation part of the names of Habitat-Sim on gsnav, for unmodified scripts of habitat-lab.

The distribution gsnav-habitat provides this package. `habitat_sim.__gsnav__` is True. A name that is not served raises
NotImplementedError when it is used.
"""

import gsnav_habitat as _shared

_shared.claim()

from . import _unserved, agent, errors, gaussian_avatar, geo, logging, metadata, nav  # noqa: E402
from . import physics, scene, sensor, sensors, simulator, utils  # noqa: E402
from ._unserved import *  # noqa: E402, F403
from .agent import (  # noqa: E402
    ActionSpec,
    ActuationSpec,
    Agent,
    AgentConfiguration,
    AgentState,
    PyRobotNoisyActuationSpec,
    SceneNodeControl,
    SixDOFPose,
)
from .nav import (  # noqa: E402
    GreedyFollowerCodes,
    GreedyGeodesicFollower,
    HitRecord,
    MultiGoalShortestPath,
    NavMeshSettings,
    PathFinder,
    ShortestPath,
)
from .physics import RigidState  # noqa: E402
from .registry import registry  # noqa: E402
from .scene import SceneGraph, SceneNode  # noqa: E402
from .sensor import (  # noqa: E402
    CameraSensorSpec,
    EquirectangularSensorSpec,
    FisheyeSensorDoubleSphereSpec,
    FisheyeSensorModelType,
    FisheyeSensorSpec,
    SensorSpec,
    SensorSubType,
    SensorType,
    VisualSensorSpec,
)
from .simulator import Configuration, Simulator, SimulatorConfiguration  # noqa: E402
from .sensors import noise_models  # noqa: E402, F401
from .utils import profiling_utils  # noqa: E402

__gsnav__ = True
__version__ = gsnav_version = _shared.version()
cuda_enabled = built_with_bullet = audio_enabled = vhacd_enabled = False
stage_id = -1

_shared.complete(__name__)
__all__ = [name for name in globals() if not name.startswith("_")]
