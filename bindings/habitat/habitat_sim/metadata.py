# SPDX-License-Identifier: Apache-2.0
"""Metadata of scenes. Without objects there is nothing to manage."""

from typing import Any


class TemplateManager:
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


class MetadataMediator:
    """Holds the settings of a simulator."""

    def __init__(self, sim_cfg: Any = None) -> None:
        self.sim_cfg = sim_cfg
        self.active_dataset = "default" if sim_cfg is None else sim_cfg.scene_dataset_config_file
        self.object_template_manager = self.ao_template_manager = TemplateManager()
