// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Numbers that a Gaussian has in SH bands 1 to `degree`, of all channels: 0, 9, 24 or 45.
constexpr std::size_t sh_band_numbers(int degree) noexcept {
  return 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
}

/// The highest SH degree that any chunk needs: bands above it need not be held.
inline int needed_sh_degree(const ColorRows& v) noexcept {
  if (v.chunk_degrees.empty()) return v.degree;
  int most = 0;
  for (const std::uint8_t degree : v.chunk_degrees)
    most = std::max(most, std::min(v.degree, int{degree}));
  return most;
}

/// The first `to` of the `from` numbers of each of n rows, to `out`, which may be where the rows are.
template <class T>
void cut_rows(const T* rows, std::size_t n, std::size_t from, std::size_t to, T* out) noexcept {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < to; ++k) out[to * i + k] = rows[from * i + k];
  }
}

/// What of a cloud a frame has to read: measured once by scene_bands (detail/scene/scene_bands.hpp).
struct SceneBands {
  std::vector<std::uint8_t> chunk_sh_degrees;  ///< what ColorRows::chunk_degrees takes, [chunks]
  std::uint64_t sh_numbers = 0;  ///< SH coefficients above degree 0, of all channels, that there are
  std::uint64_t sh_numbers_read = 0;  ///< of these, in the bands that are kept
  double color_error = 0;             ///< no colour changes by more; 0 where only zeros are left out
  // Of drop_bands (detail/scene/drop_bands.hpp), which keeps the bands that some chunk needs:
  std::uint64_t bytes_let_go = 0;    ///< what it gave back
  std::uint64_t bytes_unneeded = 0;  ///< what is held of bands that their own chunk does not need

  /// The set, of arrays in host memory, without the bands that were found to say nothing. This must
  /// outlive it. For other backends: GaussianArrays.
  GaussianSet applied_to(GaussianSet set) const& noexcept {
    set.gaussians.color.chunk_degrees = {chunk_sh_degrees.data(), chunk_sh_degrees.size()};
    return set;
  }
  GaussianSet applied_to(GaussianSet set) const&& = delete;
};

}  // namespace gsnav
