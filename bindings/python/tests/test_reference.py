# SPDX-License-Identifier: Apache-2.0
"""The bits of a batch are those of a C++ program without Python."""

import os
import subprocess

import numpy as np
import pytest

import gsnav


def hashed(h, values):
    for bits in values.ravel().view(np.uint32).tolist():
        h = ((h ^ bits) * 0x100000001B3) % 2**64
    return h


def test_batch_has_the_bits_of_the_cpp_batch():
    program = os.environ.get("GSNAV_PYTHON_REFERENCE")
    if not program:
        pytest.skip("GSNAV_PYTHON_REFERENCE is not set: the program gsnav_python_reference")
    run = subprocess.run([program, "5", "32", "20", "0.05"], check=True, capture_output=True, text=True)
    scene = gsnav.default_simulator_scene(people=0, seed=1, density=0.05)
    config = gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(32, 32))
    envs = gsnav.VectorEnv(5, scene, device="serial", config=config,
                           episodes=gsnav.generate_episodes(scene.navmesh, 1, 1))
    envs.reset()
    for i in range(20):
        observations = envs.step(1 + (np.arange(5) + i) % 3)[0]
    h = hashed(hashed(0xCBF29CE484222325, observations["rgb"]), observations["depth"])
    assert f"{h:016x}" == run.stdout.split()[0]
