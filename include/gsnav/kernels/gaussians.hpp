// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// The screen-space filter that an asset was trained with.
enum class Filter : std::uint8_t {
  classic,  ///< eps2d is added to the 2D covariance, opacity stays (INRIA)
  mip,      ///< ... and opacity is multiplied by sqrt(det0 / det) (Mip-Splatting, antialiased)
};

/// Number of SH coefficients per channel up to `degree`.
GSNAV_HD constexpr int sh_coefficient_count(int degree) noexcept { return (degree + 1) * (degree + 1); }

/// Highest SH degree the kernels evaluate.
inline constexpr int kMaxShDegree = 3;

/// How many consecutive Gaussians are culled together and projected as one work item.
inline constexpr std::size_t kProjectChunk = 256;

/// What a chunk of Gaussians may reach: a bound for all of them, in the asset's frame.
struct ChunkBounds {
  Vec3d low{}, high{};    ///< box of the means, metres
  float scale_max = 0;    ///< largest standard deviation, metres
  float opacity_max = 0;  ///< in [0, 1]
};

/// Read-only arrays of N Gaussians, as kernels see them. Owns nothing.
///
/// Metres in the asset's own frame. A position is `origins[origin_ids[i]] + mean_i`: float32 offsets
/// from origins on a 64 m lattice, so that scenes far from zero lose nothing.
struct GaussianView {
  std::size_t size = 0;                    ///< N
  View<const float> means[3];              ///< x, y, z offsets, [N] each
  View<const float> quats[4];              ///< w, x, y, z of unit length, [N] each
  View<const float> scales[3];             ///< standard deviations >= 0, [N] each
  View<const float> opacities;             ///< in [0, 1], [N]
  View<const float> sh0;                   ///< [N][3], the degree-0 coefficients
  View<const float> shN;                   ///< [N][(degree+1)^2 - 1][3], empty for degree 0
  /// The same as IEEE binary16 (math/half.hpp), in place of shN, which is empty then; half of most of what a Gaussian
  /// takes. In host memory only: GaussianArrays gives other backends floats.
  View<const std::uint16_t> shN_half;
  int sh_degree = 0;                       ///< 0 to 3
  View<const std::uint32_t> origin_ids;    ///< [N], or empty: all 0
  View<const Vec3d> origins;               ///< host memory; empty: one origin at zero
  /// Rotation each Gaussian has made since training (w, x, y, z), empty where none has: the view
  /// direction is turned back by it before SH is evaluated. Used for skinned sets of degree >= 1.
  View<const float> sh_rotations[4];
  /// Shapes that are no rotated ellipsoids' (a skinned Gaussian's blended axes): [3 r + c] is row r,
  /// column c of the factor M, Sigma = M M^T, asset frame, metres. They stand in for quats and scales,
  /// which may then be empty; empty where those hold.
  View<const float> axes[9];
  /// Place of each Gaussian before rows were sorted in space, [N]: those of one depth are blended in that
  /// order. Empty: row order.
  View<const std::uint32_t> row_ids;
  /// One a chunk of kProjectChunk rows, [ceil(N / kProjectChunk)]: chunks that cannot be seen are not
  /// touched. Empty: all are.
  View<const ChunkBounds> chunk_bounds;

  GSNAV_HD std::size_t chunk_count() const noexcept { return (size + kProjectChunk - 1) / kProjectChunk; }
};

/// What the numbers of a colour mean.
enum class ColorSpace : std::uint8_t {
  display,  ///< sRGB-encoded: what screens take, and nearly all captures are trained in
  linear,   ///< proportional to light, Rec. 709 primaries
};

/// One set of Gaussians in the world: a scene tile, an avatar, an object.
struct GaussianSet {
  GaussianView gaussians;
  Similarity world_from_asset{};
  Filter filter = Filter::classic;
  float eps2d = 0.3f;  ///< px^2 added to the diagonal of the 2D covariance
  ColorSpace color_space = ColorSpace::display;  ///< of its colours; converted to the frame's after SH
};

}  // namespace gsnav
