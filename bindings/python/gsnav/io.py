# SPDX-License-Identifier: Apache-2.0
"""Files of scenes, cameras, episodes, levels of detail and visible sets."""

from ._gsnav import (
    ClampedValues,
    check_scene_output,
    count_clamped,
    load_cameras,
    load_episodes,
    load_lod,
    load_visible_sets,
    save_cameras,
    save_episodes,
    save_lod,
    save_scene,
    save_visible_sets,
)

__all__ = ["ClampedValues", "check_scene_output", "count_clamped", "load_cameras", "load_episodes", "load_lod",
           "load_visible_sets", "save_cameras", "save_episodes", "save_lod", "save_scene", "save_visible_sets"]
