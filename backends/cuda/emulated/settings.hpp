// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace gsnav::emulated {

/// GSNAV_EMULATED_SEED: which order threads and blocks run in. With 0, the default, as they are
/// numbered, each as far as it gets.
std::uint64_t seed();

/// GSNAV_EMULATED_PROCESSORS: multiprocessors that the device says it has, 1 to 1024; 4 unless told.
std::uint64_t processors();

}  // namespace gsnav::emulated
