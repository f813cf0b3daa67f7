// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Number of SH coefficients of a Gaussian in bands 1 to `degree`, in all three channels: 0, 9, 24 or
/// 45.
constexpr std::size_t sh_band_numbers(int degree) noexcept {
  return 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
}

/// The highest SH degree that any chunk needs. Higher bands need not be stored.
inline int needed_sh_degree(const ColorRows& v) noexcept {
  if (v.chunk_degrees.empty()) return v.degree;
  int most = 0;
  for (const std::uint8_t degree : v.chunk_degrees)
    most = std::max(most, std::min(v.degree, int{degree}));
  return most;
}

/// Copies the first `to` of the `from` numbers of each of n rows to `out`, which may be `rows` itself.
template <class T>
void narrow_rows(const T* rows, std::size_t n, std::size_t from, std::size_t to, T* out) noexcept {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < to; ++k) out[to * i + k] = rows[from * i + k];
  }
}

/// The SH bands that each chunk of a cloud needs, measured once by scene_bands
/// (detail/scene/scene_bands.hpp).
struct SceneBands {
  std::vector<std::uint8_t> chunk_sh_degrees;  ///< [chunks], for ColorRows::chunk_degrees.
  std::uint64_t sh_numbers = 0;       ///< SH coefficients above degree 0 in the cloud, in all channels.
  std::uint64_t sh_numbers_read = 0;  ///< Number of those in needed bands.
  double color_error = 0;             ///< Largest change of a colour by leaving out the rest; 0 where
                                      ///< only zeros are left out.
  // Set by drop_bands (detail/scene/drop_bands.hpp), which keeps every band that some chunk needs.
  std::uint64_t bytes_let_go = 0;    ///< Bytes that drop_bands freed.
  std::uint64_t bytes_unneeded = 0;  ///< Bytes still stored of bands that their own chunk does not need.

  /// The set without the bands that are not needed. `set` has arrays in host memory; for other backends
  /// use GaussianArrays. This object must outlive the result.
  GaussianSet applied_to(GaussianSet set) const& noexcept {
    set.gaussians.color.chunk_degrees = {chunk_sh_degrees.data(), chunk_sh_degrees.size()};
    return set;
  }
  GaussianSet applied_to(GaussianSet set) const&& = delete;
};

}  // namespace gsnav
