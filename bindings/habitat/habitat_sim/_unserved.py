# SPDX-License-Identifier: Apache-2.0
"""Names of Habitat-Sim that scripts import and gsnav does not serve, by their modules."""

import sys
import types
from typing import Any

import gsnav_habitat as _shared

_MODULES: dict[str, tuple[str, ...]] = {
    "gfx": ("DebugLineRender", "LightInfo", "LightPositionModel", "RenderCamera", "RenderTarget", "Renderer"),
    "attributes": ("ObjectAttributes", "StageAttributes", "PhysicsManagerAttributes", "ArticulatedObjectAttributes"),
    "attributes_managers": ("ObjectAttributesManager", "StageAttributesManager", "AssetAttributesManager"),
    "sim": ("SimulatorBackend",),
    "bindings": ("Configuration", "ConfigValType"),
    "_ext.habitat_sim_bindings": ("Configuration", "AssetType", "RenderInstanceHelper"),
}
_NAMES = ("ReplayRenderer", "ReplayRendererConfiguration", "AbstractReplayRenderer", "AudioSensorSpec",
          "AssetType", "RenderInstanceHelper")  # fmt: skip


def _module(name: str, names: tuple[str, ...]) -> types.ModuleType:
    full = f"habitat_sim.{name}"
    made = types.ModuleType(full, "Names that gsnav does not serve.")
    made.__getattr__ = _shared.missing(full)  # type: ignore[method-assign]
    for each in names:
        setattr(made, each, _shared.unserved(full, each))
    sys.modules[full] = made
    return made


def _make() -> dict[str, Any]:
    made: dict[str, Any] = {name: _shared.unserved("habitat_sim", name) for name in _NAMES}
    extension = _module("_ext", ())
    extension.__path__ = []  # type: ignore[attr-defined]
    for name, names in _MODULES.items():
        module = _module(name, names)
        if "." in name:
            setattr(extension, name.rsplit(".", 1)[1], module)
        else:
            made[name] = module
    made["_ext"] = extension
    made["bindings"].built_with_bullet = made["bindings"].cuda_enabled = False
    return made


_made = _make()
globals().update(_made)
__all__ = list(_made)
