# SPDX-License-Identifier: Apache-2.0
"""A tree of nodes with rigid poses, which carries agents and sensors. gsnav serves no objects and no labels."""

import math
from typing import Any, Iterator

import numpy as np

import gsnav_habitat as _shared
from magnum import Matrix4, Quaternion, Vector3


def _unit(value: Any, what: str) -> Quaternion:
    """A rotation of any length as one of length 1. Raises ValueError naming `what` if it has no direction."""
    rotation = Quaternion._of(value)
    length = rotation.length()
    if not 0 < length < math.inf:
        raise ValueError(f"{what} = {value}: is not finite, or has length 0")
    return rotation.normalized()


class SceneNode(_shared.Sealed):
    """A node with a rotation and a translation relative to its parent, metres."""

    _translation: Vector3
    _rotation: Quaternion
    _world: "tuple[Vector3, Quaternion] | None"

    def __init__(self, parent: "SceneNode | None" = None) -> None:
        self.children: list[SceneNode] = []
        self._simulator: Any = None  # The simulator of a root.
        self.parent = parent
        self._put(Vector3(), Quaternion())
        self.node_sensors: dict[str, Any] = {}
        if parent is not None:
            parent.children.append(self)

    # ---- The tree
    def create_child(self) -> "SceneNode":
        """A new node at this one."""
        return SceneNode(self)

    def remove(self) -> None:
        """Takes the node out of the tree."""
        if self.parent is not None:
            self.parent.children.remove(self)
            self.parent = None
            self._forget()

    def _subtree(self) -> Iterator["SceneNode"]:
        yield self
        for child in self.children:
            yield from child._subtree()

    @property
    def subtree_sensors(self) -> dict[str, Any]:
        """Sensors of this node and those below, by their names."""
        return {uuid: s for node in self._subtree() for uuid, s in node.node_sensors.items()}

    # ---- Pose relative to the parent
    def _put(self, translation: Vector3, rotation: Quaternion) -> None:
        self.__dict__.update(_translation=translation, _rotation=rotation)  # Past __setattr__, because it is frequent.
        self._forget()

    def _forget(self) -> None:
        """Poses in the world are kept until a node above changes."""
        self.__dict__["_world"] = None
        for child in self.children:
            child._forget()

    @property
    def translation(self) -> Vector3:
        """Translation, a copy. Assign any sequence of three numbers."""
        return Vector3(self._translation)

    @translation.setter
    def translation(self, value: Any) -> None:
        self._put(Vector3(*(float(x) for x in value)), self._rotation)

    @property
    def rotation(self) -> Quaternion:
        """Rotation, a copy. Assign a magnum.Quaternion or a quaternion of numpy-quaternion."""
        return Quaternion(self._rotation)

    @rotation.setter
    def rotation(self, value: Any) -> None:
        self._put(self._translation, _unit(value, "SceneNode.rotation"))

    @property
    def transformation(self) -> Matrix4:
        """Pose relative to the parent."""
        return Matrix4.from_(self._rotation.to_matrix(), self._translation)

    @transformation.setter
    def transformation(self, value: Any) -> None:
        self._put(value.translation, Quaternion.from_matrix(value.rotation()).normalized())

    def set_translation(self, value: Any) -> "SceneNode":
        """Assigns `translation`."""
        self.translation = value
        return self

    def set_rotation(self, value: Any) -> "SceneNode":
        """Assigns `rotation`."""
        self.rotation = value
        return self

    def reset_transformation(self) -> "SceneNode":
        """Puts the node at its parent."""
        self._put(Vector3(), Quaternion())
        return self

    def translate(self, vector: Any) -> "SceneNode":
        """Moves along the parent's axes, metres."""
        self._put(self._translation + vector, self._rotation)
        return self

    def translate_local(self, vector: Any) -> "SceneNode":
        """Moves along the node's own axes, metres."""
        self._put(self._translation + self._rotation.transform_vector(vector), self._rotation)
        return self

    def rotate(self, angle: Any, axis: Any) -> "SceneNode":
        """Turns about an axis of the parent, with its origin."""
        turn = Quaternion.rotation(angle, axis)
        self._put(turn.transform_vector(self._translation), (turn * self._rotation).normalized())
        return self

    def rotate_local(self, angle: Any, axis: Any) -> "SceneNode":
        """Turns about an axis of the node."""
        self._put(self._translation, (self._rotation * Quaternion.rotation(angle, axis)).normalized())
        return self

    def rotate_x_local(self, angle: Any) -> "SceneNode":
        """Turns about the node's x."""
        return self.rotate_local(angle, Vector3.x_axis())

    def rotate_y_local(self, angle: Any) -> "SceneNode":
        """Turns about the node's y."""
        return self.rotate_local(angle, Vector3.y_axis())

    def rotate_z_local(self, angle: Any) -> "SceneNode":
        """Turns about the node's z."""
        return self.rotate_local(angle, Vector3.z_axis())

    # ---- Pose in the world
    def _in_world(self) -> tuple[Vector3, Quaternion]:
        if self._world is None:
            if self.parent is None:
                self.__dict__["_world"] = self._translation, self._rotation
            else:
                at, turn = self.parent._in_world()
                self.__dict__["_world"] = (
                    at + turn.transform_vector(self._translation),
                    (turn * self._rotation).normalized(),
                )
        return self._world

    @property
    def absolute_rotation(self) -> Quaternion:
        """Rotation in the world, a copy."""
        return Quaternion(self._in_world()[1])

    @property
    def absolute_translation(self) -> Vector3:
        """Position in the world in metres, a copy."""
        return Vector3(self._in_world()[0])

    def absolute_transformation(self) -> Matrix4:
        """Pose in the world."""
        return Matrix4.from_(self.absolute_rotation.to_matrix(), self.absolute_translation)

    def absolute_transformation_matrix(self) -> np.ndarray:
        """Pose in the world, float32 [4][4]."""
        return np.array(self.absolute_transformation())

    absolute_position = absolute_translation

    def _place(self, position: Any, rotation: Quaternion) -> None:
        """Sets the pose in the world."""
        if self.parent is None:
            self.translation, self.rotation = position, rotation
            return
        back = self.parent.absolute_rotation.inverted_normalized()
        self.translation = back.transform_vector(Vector3(position) - self.parent.absolute_translation)
        self.rotation = back * rotation


_shared.unserved_members(
    SceneNode, "type", "semantic_id", "object_semantic_id", "drawable_semantic_id", "cumulative_bb", "mesh_bb",
    "compute_cumulative_bb", "drawables", "absolute_aabb",
)  # fmt: skip


class SceneGraph(_shared.FullySealed):
    """A tree of nodes."""

    def __init__(self) -> None:
        self._root = SceneNode()

    def get_root_node(self) -> SceneNode:
        """The node that has no parent."""
        return self._root


for _name in ("SemanticRegion", "SemanticObject", "SemanticCategory", "SemanticLevel", "SemanticScene",
              "ObjectControls", "SceneNodeType"):  # fmt: skip
    globals()[_name] = _shared.unserved("habitat_sim.scene", _name)
