# SPDX-License-Identifier: Apache-2.0
"""Renders a scene to numpy arrays. usage: render_scan.py [SCENE [DEVICE]]; writes scan.npz"""

import pathlib
import sys

import numpy as np
from pointnav_files import aside

import gsnav


def main(scene_name: str = "default", device_name: str = "best") -> None:
    # [snippet: render]
    device = gsnav.Device.parse(device_name)
    scene = gsnav.open_scene(scene_name)  # PLY, SOG, SPZ, glTF, ...
    camera = gsnav.framing_camera(scene, 640, 480)
    frames = gsnav.Renderer(device, scene).render(camera)
    rgb, depth = frames.rgb, frames.median_depth  # float32 [480][640][3] and [480][640], metres
    # [/snippet]
    assert rgb is not None and depth is not None
    with aside(pathlib.Path("scan.npz")) as part:
        np.savez_compressed(part, rgb=gsnav.to_bytes(rgb), depth=depth)
    print(f"{scene.name} on {device.description}: median depth {np.median(depth):.2f} m")


if __name__ == "__main__":
    main(*sys.argv[1:])
