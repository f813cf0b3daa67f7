// SPDX-License-Identifier: Apache-2.0
// What tests render with, compiled once.
#include "ops/backends.hpp"

GSNAV_TEST_KERNELS(, gsnav::SerialBackend);
GSNAV_TEST_KERNELS(, gsnav_test::ToyBackend);

namespace gsnav {

GSNAV_FRAME_FUNCTIONS(, float, SerialBackend);
GSNAV_FRAME_FUNCTIONS(, double, SerialBackend);
GSNAV_FRAME_FUNCTIONS(, float, ToyBackend);
GSNAV_SKIN_FUNCTIONS(, SerialBackend);

}  // namespace gsnav
