# SPDX-License-Identifier: Apache-2.0
"""People of a scene, with the names that scripts of Habitat-GS use. The simulator poses and moves people itself."""

from typing import Any, Iterable

import numpy as np

import gsnav_habitat as _shared


class GaussianAvatar(_shared.FullySealed):
    """A person of a scene."""

    def __init__(self, sim: Any, avatar_id: int) -> None:
        self.sim, self.avatar_id = sim, avatar_id
        self.name = f"gaussian_avatar_{avatar_id}"

    def get_navmesh_capsules(self) -> np.ndarray:
        """Capsules that stop agents, at the present time: float32 [N][7], x0, y0, z0, x1, y1, z1, radius in metres.
        There are none while the person is absent, or in a scene without a NavMesh."""
        self.sim._need_open("get_navmesh_capsules")
        tracker = self.sim._tracker(self.sim.config.sim_cfg.default_agent_id)
        if tracker is None:
            return np.empty((0, 7), np.float32)
        return tracker.capsules(self.sim.gaussian_time, self.avatar_id).astype(np.float32)

    def update(self, sim: Any = None) -> bool:
        """Returns whether the person is present. It needs no update."""
        return len(self.get_navmesh_capsules()) > 0


class GaussianAvatarManager(_shared.FullySealed):
    """All people of a scene."""

    def __init__(self, avatars: Iterable[GaussianAvatar]) -> None:
        self.avatars = list(avatars)

    def update(self, sim: Any = None) -> None:
        """Does nothing, because people need no update."""


def load_gaussian_avatars(sim: Any, scene_instance_path: Any = None, configs: Any = None) -> list[GaussianAvatar]:
    """The people that the simulator opened with its scene. Raises NotImplementedError for another description."""
    if scene_instance_path is not None or configs is not None:
        raise NotImplementedError(
            "gsnav: load_gaussian_avatars takes no scene_instance_path and no configs: open a scene with people"
        )
    return [GaussianAvatar(sim, i) for i in sim.get_gaussian_avatar_ids()]
