# SPDX-License-Identifier: Apache-2.0
"""Name that habitat-lab imports. The distribution gsnav-habitat provides this package."""

import gsnav_habitat as _shared

_shared.claim()

__gsnav__ = True
containers = _shared.unserved("corrade", "containers")
pluginmanager = _shared.unserved("corrade", "pluginmanager")
_shared.complete(__name__)
