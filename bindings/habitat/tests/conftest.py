# SPDX-License-Identifier: Apache-2.0
"""The packages under test come from this folder's parent, installed or not."""

import pathlib
import sys
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
with warnings.catch_warnings():  # The notice of the first import.
    warnings.simplefilter("ignore")
    import magnum  # noqa: F401
