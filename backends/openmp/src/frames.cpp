// SPDX-License-Identifier: Apache-2.0
#include "gsnav/backends/openmp.hpp"

namespace gsnav {

GSNAV_FRAME_FUNCTIONS(, float, OpenMPBackend);
GSNAV_FRAME_FUNCTIONS(, double, OpenMPBackend);
GSNAV_SKIN_FUNCTIONS(, OpenMPBackend);

}  // namespace gsnav
