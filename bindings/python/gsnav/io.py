# SPDX-License-Identifier: Apache-2.0
"""Files of cameras and episodes."""

from ._gsnav import load_cameras, load_episodes, save_cameras, save_episodes

__all__ = ["load_cameras", "load_episodes", "save_cameras", "save_episodes"]
