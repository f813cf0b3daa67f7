// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstring>
#include <span>

namespace gsnav_test {

/// Whether two images are the same, bit for bit; none is not an image.
inline bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && !a.empty() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

}  // namespace gsnav_test
