# SPDX-License-Identifier: Apache-2.0
"""Shares the images of many environments with JAX. usage: on_jax.py [ENVIRONMENTS [STEPS]]; needs jax"""

import sys

import jax

import gsnav


def main(environments: int = 4, steps: int = 10) -> None:
    # [snippet: jax]
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(64, 64))
    envs = gsnav.VectorEnv(environments, device="cpu", config=config)
    observations, infos = envs.reset(seed=1)
    nearest = jax.jit(lambda depth: depth.min(axis=(1, 2, 3)))
    for _ in range(steps):
        images = observations["depth"]
        depth = jax.dlpack.from_dlpack(images)  # shares the image's memory
        clear = nearest(depth) > 0.5  # metres
        actions = jax.numpy.where(clear, int(gsnav.Action.move_forward), int(gsnav.Action.turn_left))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
    # [/snippet]
    shared = depth.unsafe_buffer_pointer() == images.ctypes.data
    print(f"{steps} steps of {environments} environments, memory is shared: {shared}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
