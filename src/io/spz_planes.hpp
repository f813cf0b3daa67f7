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

/// An SPZ out of its compression, in the planes of the cloud that comes of it, so that no other memory
/// is held: sh0 and shN (bands up to degree 3) as they are, the rest as stored, row i of which is
///   means       x, y, z in the reader's axes, the origin being zero, no float being more than the file
///   has opacities   the byte, 0 to 255 scales      natural logarithms quats[0]    the file's 3 or 4
///   bytes, no number
struct SpzPlanes {
  SpzHeader header;
  GaussianCloud cloud;
  std::vector<std::string> warnings;
};

/// Unpacks versions 1 to 3 (one gzip stream) and 4 (a zstd stream for each plane); `turn`: half a turn
/// about x. Sizes are checked against the header, the header's count against the bytes there are, before
/// memory is asked for. Of the file there is one stream at a time in memory, of gzip a piece.
Result<SpzPlanes> read_spz_planes(const ByteSource& bytes, const std::string& source, bool turn);

}  // namespace gsnav::io::detail
