# SPDX-License-Identifier: Apache-2.0
"""The packages under test come from this folder's parent, installed or not."""

import pathlib
import sys
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
with warnings.catch_warnings():  # The notice of the first import.
    warnings.simplefilter("ignore")
    import magnum  # noqa: F401

import importlib.util  # noqa: E402

import pytest  # noqa: E402


@pytest.fixture(scope="session")
def pack_tool():
    """The module tools/make_habitat_pack.py."""
    pytest.importorskip("gsnav")
    path = pathlib.Path(__file__).resolve().parents[3] / "tools" / "make_habitat_pack.py"
    spec = importlib.util.spec_from_file_location("make_habitat_pack", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def pack(pack_tool, tmp_path_factory):
    """A stand-in data pack with few episodes. Its folder has data/."""
    folder = tmp_path_factory.mktemp("pack")
    pack_tool.make(folder, train=8, others=8)
    return folder


@pytest.fixture(scope="session")
def stage(pack):
    """Path of the first scene: a room from -5 to 6 m in x and -4.5 to 10.5 m in z, floor at 0.07 m, walls 0.1 m."""
    return str(pack / "data/scene_datasets/habitat-test-scenes/skokloster-castle.glb")
