// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// Errors that packing may cause. Where a limit would be exceeded, values are stored more exactly.
struct PackLimits {
  /// Largest movement of a mean, in the Gaussian's largest standard deviations; above it means stay
  /// float32. 16 bits within a chunk's box save 6 bytes for each Gaussian, but Gaussians at nearly one
  /// depth may change places (docs/reference/formats.md).
  double mean = 0;
  double sh = 2e-3;  ///< Largest root mean square error of SH coefficients of bands 1 to 3 with 8 bits;
                     ///< above it they become binary16.
  double sh_max = 2e-3;  ///< Largest error of such a coefficient as binary16; above it they stay
                         ///< float32.
};

/// A GaussianCloud in a third of the memory: for each Gaussian 26 bytes for position, shape and opacity,
/// 6 for its colour, and 45 for SH degree 3 with 8 bits. Host backends render it directly, with the same
/// bits as the floats of unpack_cloud; GaussianArrays gives those floats to other backends. Call
/// unpack_cloud before you edit or write it. Pack sorted clouds only, because positions are steps within
/// a chunk's box.
struct PackedCloud {
  std::vector<std::uint16_t> codes;  ///< ShapeRows::codes.
  std::vector<std::uint16_t> sh0;    ///< [N][3], binary16.
  std::vector<std::int8_t> shN;      ///< [N][(degree+1)^2 - 1][3]; empty if `rest` has the bands.
  std::vector<PackedChunk> chunks;   ///< [ceil(N / kProjectChunk)].
  std::size_t count = 0;             ///< N, the number of Gaussians.
  /// Everything that is not packed: ids, origins, chunk bounds, settings of the asset, and arrays that
  /// stay as they are because packing them would exceed a limit of PackLimits.
  GaussianCloud rest;

  /// Number of Gaussians, N.
  std::size_t size() const noexcept { return count; }
  /// Bytes of the arrays.
  std::size_t bytes() const noexcept {
    return sizeof(std::uint16_t) * (codes.size() + sh0.size()) + shN.size() +
           sizeof(PackedChunk) * chunks.size() + rest.bytes() +
           sizeof(float) * (rest.means[0].empty() ? 0 : 3 * count);
  }
  /// Views of the arrays for kernels. Valid while the cloud lives.
  GaussianRows view() const& noexcept {
    GaussianRows v = rest.view();
    v.shape.size = count;
    v.shape.codes = view_of(codes);
    v.color.sh0_half = view_of(sh0);
    v.color.shN_codes = view_of(shN);
    v.shape.chunks = v.color.chunks = view_of(chunks);
    return v;
  }
  /// Deleted: the view would point into a temporary.
  GaussianRows view() const&& = delete;
  /// The cloud placed in the world, with views of its arrays. Valid while the cloud lives.
  GaussianSet set(const Similarity& world_from_asset = {}) const& noexcept {
    return {view(), world_from_asset, rest.filter, rest.eps2d, rest.color_space};
  }
  /// Deleted: the set would point into a temporary.
  GaussianSet set(const Similarity& world_from_asset = {}) const&& = delete;
};

}  // namespace gsnav
