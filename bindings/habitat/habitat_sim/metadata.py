# SPDX-License-Identifier: Apache-2.0
"""Metadata of scenes. Without objects there is nothing to manage."""

from typing import Any

import gsnav_habitat as _shared


class TemplateManager(_shared.FullySealed):
    """A manager of templates that has none, because gsnav serves no objects."""

    def load_configs(self, path: str, save_as_defaults: bool = False) -> list[int]:
        """Returns an empty list."""
        return []

    def get_num_templates(self) -> int:
        """0."""
        return 0

    def get_template_handles(self, *arguments: Any) -> list[str]:
        """Returns an empty list."""
        return []


class MetadataMediator(_shared.FullySealed):
    """Holds the settings of a simulator. Its data set is that of the settings."""

    def __init__(self, sim_cfg: Any = None) -> None:
        self.sim_cfg = sim_cfg
        self.object_template_manager = self.ao_template_manager = TemplateManager()

    @property
    def active_dataset(self) -> str:
        """Name of the data set."""
        return "default" if self.sim_cfg is None else self.sim_cfg.scene_dataset_config_file

    @active_dataset.setter
    def active_dataset(self, value: str) -> None:
        if value != self.active_dataset:
            name = f"habitat_sim.metadata.MetadataMediator.active_dataset = {value!r}"
            raise _shared.NotServed(_shared.message(name))
