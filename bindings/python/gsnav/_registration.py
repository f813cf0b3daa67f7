# SPDX-License-Identifier: Apache-2.0
"""Registers the environments of this package with Gymnasium."""

import gymnasium


def register() -> None:
    """Makes "gsnav/PointNav-v0" known to gymnasium.make and gymnasium.make_vec."""
    if "gsnav/PointNav-v0" not in gymnasium.registry:
        gymnasium.register("gsnav/PointNav-v0", entry_point="gsnav:Env", vector_entry_point="gsnav:VectorEnv")
