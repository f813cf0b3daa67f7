// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// A Selection::seen of the rows of which `may` is true.
inline std::vector<std::uint32_t> seen_words(const std::vector<bool>& may) {
  const std::size_t chunks = (may.size() + gsnav::kProjectChunk - 1) / gsnav::kProjectChunk;
  const std::size_t words = (chunks + 31) / 32;
  std::vector<std::uint32_t> out(2 * words);
  std::uint32_t count = 0;
  for (std::size_t c = 0; c < chunks; ++c) {
    if (c % 32 == 0) out[words + c / 32] = count;
    std::uint32_t rows[gsnav::kSeenRowWords] = {}, any = 0;
    for (std::size_t r = 0; r < gsnav::kProjectChunk; ++r) {
      const std::size_t i = c * gsnav::kProjectChunk + r;
      if (i < may.size() && may[i]) rows[r / 32] |= 1u << (r % 32);
    }
    for (const std::uint32_t word : rows) any |= word;
    if (any == 0) continue;
    out[c / 32] |= 1u << (c % 32);
    out.insert(out.end(), rows, rows + gsnav::kSeenRowWords);
    ++count;
  }
  return out;
}

/// Rows that may be seen: of a third of the chunks none, of a third all, of the others some.
inline std::vector<bool> random_rows(gsnav::Rng& rng, std::size_t size) {
  std::vector<bool> out(size);
  double share = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (i % gsnav::kProjectChunk == 0) {
      const double which = rng.uniform(0, 3);
      share = which < 1 ? 0 : which < 2 ? 1 : rng.uniform(0.02, 0.9);
    }
    out[i] = rng.uniform(0, 1) < share;
  }
  return out;
}

/// The cloud with the other rows transparent.
inline gsnav::GaussianCloud only_seen(gsnav::GaussianCloud cloud, const std::vector<bool>& may) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!may[i]) cloud.opacities[i] = 0;
  }
  return cloud;
}

}  // namespace gsnav_test
