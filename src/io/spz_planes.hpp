// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "file.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav::io::detail {

inline constexpr std::uint32_t kSpzMagic = 0x5053474e;  // "NGSP"
inline constexpr unsigned kSpzAntialiased = 1, kSpzExtensions = 2;

// Half a turn about x negates y and z, so a basis function changes sign for odd powers of the two
// together.
inline constexpr std::array<float, 15> kHalfTurnAboutX = {-1, -1, 1,  -1, 1, 1,  -1, 1,
                                                          -1, 1,  -1, -1, 1, -1, 1};

/// The header of an SPZ file of any version.
struct SpzHeader {
  std::uint32_t version = 4, count = 0;
  int degree = 0;  ///< 0 to 4.
  int fractional_bits = 12;
  unsigned flags = 0;

  std::size_t coefficients() const noexcept {
    return static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
  }
  /// Bytes for each Gaussian in each plane: positions, opacities, colours, scales, quaternions, SH
  /// bands.
  std::array<std::size_t, 6> widths() const noexcept {
    return {version == 1 ? 6u : 9u, 1, 3, 3, version < 3 ? 3u : 4u, 3 * coefficients()};
  }
};

/// A decompressed SPZ, in the planes of the cloud that is made from it, so that no other memory is
/// needed. sh0 and shN (bands up to degree 3) are final. The others hold stored values:
///
/// - means: x, y, z in the reader's axes, with origin zero; a float holds the file's precision.
/// - opacities: the byte, 0 to 255.
/// - scales: natural logarithms.
/// - quats[0]: the 3 or 4 bytes of the file, not a number.
struct SpzPlanes {
  SpzHeader header;
  GaussianCloud cloud;
  std::vector<std::string> warnings;
};

/// Unpacks versions 1 to 3 (one gzip stream) and 4 (one zstd stream for each plane). With `turn`,
/// rotates by half a turn about x. Before memory is allocated, sizes are checked against the header, and
/// the header's count against the number of bytes. At any time memory holds at most one stream of the
/// file (of gzip, a piece).
Result<SpzPlanes> read_spz_planes(const ByteSource& bytes, const std::string& source, bool turn);

}  // namespace gsnav::io::detail
