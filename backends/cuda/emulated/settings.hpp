// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsnav::emulated {

/// GSNAV_EMULATED_SEED: order in which threads and blocks run. 0, the default, runs them in numerical
/// order, each as far as possible.
std::uint64_t seed();

/// GSNAV_EMULATED_PROCESSORS: number of multiprocessors that the device reports, 1 to 1024. Default: 4.
std::uint64_t processors();

}  // namespace gsnav::emulated
