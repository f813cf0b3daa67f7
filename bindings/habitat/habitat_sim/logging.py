# SPDX-License-Identifier: Apache-2.0
"""The logger of habitat_sim."""

from ._engine import logger

__all__ = ["logger"]
