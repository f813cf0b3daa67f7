# SPDX-License-Identifier: Apache-2.0
"""Velocity control. gsnav serves no other physics."""

import math
from typing import Any

import gsnav_habitat as _shared
from magnum import Quaternion, Rad, Vector3


class RigidState(_shared.FullySealed):
    """A rotation and a translation, metres."""

    def __init__(self, rotation: Any = None, translation: Any = None) -> None:
        self.rotation = Quaternion() if rotation is None else Quaternion._of(rotation)
        self.translation = Vector3() if translation is None else Vector3(*(float(x) for x in translation))


class VelocityControl(_shared.FullySealed):
    """Velocities that move a body: metres and radians per second, in the frame of the world or of the body."""

    def __init__(self) -> None:
        self.controlling_lin_vel = self.controlling_ang_vel = False
        self.lin_vel_is_local = self.ang_vel_is_local = False
        self.linear_velocity, self.angular_velocity = Vector3(), Vector3()

    def __setattr__(self, name: str, value: Any) -> None:
        if name.endswith("_velocity"):
            value = Vector3(*(float(x) for x in value))
        super().__setattr__(name, value)

    def integrate_transform(self, dt: float, rigid_state: RigidState) -> RigidState:
        """Pose after `dt` seconds: translated with the rotation of the beginning, then turned."""
        rotation, translation = rigid_state.rotation, rigid_state.translation
        if self.controlling_lin_vel:
            step = self.linear_velocity * dt
            translation = translation + (rotation.transform_vector(step) if self.lin_vel_is_local else step)
        speed = self.angular_velocity.length()
        if self.controlling_ang_vel and speed > 0 and math.isfinite(speed):
            turn = Quaternion.rotation(Rad(speed * dt), self.angular_velocity / speed)
            rotation = (rotation * turn if self.ang_vel_is_local else turn * rotation).normalized()
        return RigidState(rotation, translation)


_NAMES = (
    "ArticulatedLink", "ArticulatedObjectManager", "CollisionGroupHelper", "CollisionGroups", "ContactPointData",
    "JointMotorSettings", "JointMotorType", "JointType", "LinkSet", "ManagedArticulatedObject",
    "ManagedBulletArticulatedObject", "ManagedBulletRigidObject", "ManagedRigidObject", "MotionType",
    "PhysicsSimulationLibrary", "RayHitInfo", "RaycastResults", "RigidConstraintSettings", "RigidConstraintType",
    "RigidObjectManager",
)  # fmt: skip
for _name in _NAMES:
    globals()[_name] = _shared.unserved("habitat_sim.physics", _name)
