# SPDX-License-Identifier: Apache-2.0
"""Shares the images of environments with torch, on a GPU if there is one. usage: on_torch.py [ENVIRONMENTS [STEPS]]"""

import sys

import torch
from torch.utils.dlpack import from_dlpack

import gsnav


def main(environments: int = 4, steps: int = 10) -> None:
    # [snippet: torch]
    device = "cuda" if "cuda:0" in gsnav.Device.available() else "cpu"
    config = gsnav.BatchConfig(sensors=gsnav.rgbd_sensors(64, 64), images=gsnav.ImageMemory.backend)
    envs = gsnav.VectorEnv(environments, device=device, config=config)
    observations, infos = envs.reset(seed=1)
    for _ in range(steps):
        image = observations["depth"]  # float32 [N][64][64][1], a DeviceArray on a GPU
        depth = from_dlpack(image)  # shares the image's memory
        clear = depth.amin(dim=(1, 2, 3)) > 0.5  # metres
        actions = torch.where(clear, int(gsnav.Action.move_forward), int(gsnav.Action.turn_left))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
    # [/snippet]
    where = image.__cuda_array_interface__ if device == "cuda" else image.__array_interface__
    print(f"{steps} steps of {environments} environments on {device}, memory is shared: "
          f"{depth.data_ptr() == where['data'][0]}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
