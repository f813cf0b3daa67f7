# SPDX-License-Identifier: Apache-2.0
"""Scenes that several tests share. They are small, because tests run on any machine."""

import os
import pathlib

import pytest

import gsnav


@pytest.fixture(scope="session")
def opened():
    """The embedded flat with few Gaussians and a NavMesh."""
    return gsnav.open_scene("default", gsnav.OpenOptions(navmesh="auto", density=0.05))


@pytest.fixture(scope="session")
def people():
    """The flat with two people."""
    return gsnav.default_simulator_scene(people=2, seed=1, density=0.05)


@pytest.fixture(scope="session")
def small():
    """Settings with an RGB and a depth sensor of 16 x 24 pixels and short episodes."""
    return gsnav.SimulatorConfig(sensors=gsnav.rgbd_sensors(16, 24), task=gsnav.TaskConfig(max_steps=12))


@pytest.fixture(scope="session")
def square():
    """A NavMesh on a flat square of 10 m."""
    vertices = [[0, 0, 0], [10, 0, 0], [10, 0, 10], [0, 0, 10]]
    triangles = [[0, 2, 1], [0, 3, 2]]
    import numpy as np

    return gsnav.NavMesh.build(gsnav.NavMeshSettings(), np.array(vertices, float), np.array(triangles))


@pytest.fixture(scope="session")
def tools():
    """Folder of the C++ tools, from GSNAV_TOOLS_DIR."""
    folder = os.environ.get("GSNAV_TOOLS_DIR")
    if not folder:
        pytest.skip("GSNAV_TOOLS_DIR is not set: the folder of gsnav-render and gsnav-scene")
    return pathlib.Path(folder)
