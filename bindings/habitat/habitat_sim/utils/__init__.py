# SPDX-License-Identifier: Apache-2.0
"""Helpers of scripts."""

from . import common, profiling_utils, validators
from .common import colorize_ids  # noqa: F401

__all__ = ["common", "profiling_utils", "validators"]
