# SPDX-License-Identifier: Apache-2.0
"""Names of mesh import. gsnav does not serve them."""

from typing import Any

import gsnav_habitat as _shared

MeshData = _shared.unserved("magnum.trade", "MeshData")
MeshAttribute = _shared.unserved("magnum.trade", "MeshAttribute")
SceneField = _shared.unserved("magnum.trade", "SceneField")


class ImporterManager:
    """Can be constructed, because habitat-lab does so on import. It loads nothing."""

    def load_and_instantiate(self, plugin: str) -> Any:
        """Raises NotImplementedError."""
        raise NotImplementedError(_shared.message("magnum.trade.ImporterManager.load_and_instantiate"))
