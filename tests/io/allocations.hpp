// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace gsnav_test {

/// The largest single operator new since the last call of reset_largest_allocation(), bytes.
std::size_t largest_allocation();
void reset_largest_allocation();

}  // namespace gsnav_test
