// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"

namespace gsnav::io::detail {

inline constexpr std::uint32_t kSpzMagic = 0x5053474e;  // "NGSP"
inline constexpr unsigned kSpzAntialiased = 1, kSpzExtensions = 2;

// Half a turn about x turns y and z: a basis function changes its sign with odd powers of the two.
inline constexpr std::array<float, 15> kHalfTurnAboutX = {-1, -1, 1,  -1, 1, 1,  -1, 1,
                                                          -1, 1,  -1, -1, 1, -1, 1};

/// What an SPZ's header says, whichever its version.
struct SpzHeader {
  std::uint32_t version = 4, count = 0;
  int degree = 0;  ///< 0 to 4
  int fractional_bits = 12;
  unsigned flags = 0;

  std::size_t coefficients() const noexcept {
    return static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
  }
  /// Bytes a Gaussian of each plane: positions, opacities, colours, scales, quaternions, SH bands.
  std::array<std::size_t, 6> widths() const noexcept {
    return {version == 1 ? 6u : 9u, 1, 3, 3, version < 3 ? 3u : 4u, 3 * coefficients()};
  }
};

/// An SPZ out of its compression: plane after plane, all but the bands one after the other.
struct SpzPlanes {
  SpzHeader header;
  std::array<std::size_t, 5> starts{};
  std::vector<std::byte> bytes;
  /// Room for the bands as floats, up to degree 3; the file's bytes lie at its end (widen_rows).
  std::vector<float> bands;
  std::vector<std::string> warnings;

  /// Bytes of Gaussian i in plane k, which has `width` bytes for each.
  const std::byte* at(std::size_t k, std::size_t i, std::size_t width) const noexcept {
    return bytes.data() + starts[k] + i * width;
  }
};

/// Unpacks versions 1 to 3 (one gzip stream) and 4 (a zstd stream for each plane). Sizes are checked
/// against the header, the header's count against the bytes there are, before memory is asked for.
Result<SpzPlanes> read_spz_planes(std::span<const std::byte> bytes, const std::string& source);

}  // namespace gsnav::io::detail
