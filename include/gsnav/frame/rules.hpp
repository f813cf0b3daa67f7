// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/config.hpp"

// The images of a frame, and the rules by which it is drawn.

namespace gsnav {

/// Smallest alpha that the image contract blends. Gaussians of a lower opacity are never drawn.
inline constexpr double kAlphaMin = 1.0 / 255;
/// log2 of kAlphaMin.
inline constexpr double kLog2AlphaMin = -7.99435343685885793770;

/// Largest alpha of a Gaussian in the image contract.
inline constexpr double kMaxAlpha = 0.99;
/// The image contract closes a pixel once its transmittance is lower.
inline constexpr double kTransmittanceMin = 1e-4;
/// Alpha at which first-hit depth is taken unless another is asked for.
inline constexpr double kFirstHitTau = 0.5;

/// Images that a render can produce. Combine them with |. Images that are not requested are not
/// computed.
enum Output : unsigned {
  kRgb = 1u << 0,            ///< [H][W][3], not clamped, over the background
  kAlpha = 1u << 1,          ///< [H][W], 1 - transmittance; 1 if Quality::normalize_closed applies
  kMedianDepth = 1u << 2,    ///< [H][W] metres, where transmittance falls through 1/2; 0 if it does not
  kExpectedDepth = 1u << 3,  ///< [H][W] metres, sum(w z) / sum(w); 0 if sum(w) = 0
  kAccumulatedDepth = 1u << 4,  ///< [H][W] metres, sum(w z); divided as colours are
  kFirstHitDepth = 1u << 5,     ///< [H][W] metres, where alpha first reaches first_hit_tau; 0 if it does
                                ///< not
};

/// Depths that a compiled blend loop computes. Fewer are faster.
enum class DepthMode { none, median, all };

/// Pointers to the images of one camera. Null: the image is not requested.
template <class S>
struct FrameImages {
  S* rgb = nullptr;                ///< [H][W][3].
  S* alpha = nullptr;              ///< [H][W].
  S* median_depth = nullptr;       ///< [H][W], metres.
  S* expected_depth = nullptr;     ///< [H][W], metres.
  S* accumulated_depth = nullptr;  ///< [H][W], metres.
  S* first_hit_depth = nullptr;    ///< [H][W], metres.

  GSNAV_HD DepthMode depth_mode() const noexcept;  ///< The cheapest mode that gives all these images.
  bool operator==(const FrameImages&) const = default;
};

/// Measure by which Gaussians are sorted from front to back.
enum class SortOrder : std::uint8_t {
  z_depth,          ///< depth of the centre along the view axis (INRIA)
  camera_distance,  ///< distance of the centre from the camera (KHR_gaussian_splatting)
};

/// Response of a 3D Gaussian along a pixel's ray.
enum class Response : std::uint8_t {
  ewa,            ///< linearised on the image plane at the mean (Zwicker et al. 2001); the contract
  tangent_plane,  ///< linearised on the plane perpendicular to the mean's direction (Huang et al. 2024)
  ray,            ///< exact: the maximum along the ray
};

/// Rule by which Gaussians and meshes become one image.
enum class Composite : std::uint8_t {
  merged,  ///< The rule of the contract: each Gaussian is compared with the mesh's depth at each pixel.
  hard_depth,  ///< The rule of Habitat-GS: Gaussians are drawn over the mesh where their expected depth
               ///< is not beyond it. Elsewhere only the mesh shows.
};

/// Renderer whose rules for footprint, early stop and depth a frame follows. All values but `none` are
/// for parity tests (docs/reference/image_contract.md, "Compat modes"). "Exclusive stop" means that the
/// Gaussian that closes a pixel is not blended.
enum class Compat : std::uint8_t {
  none,    ///< gsnav's own rules: the image contract
  inria,   ///< Footprint: square of 3 standard deviations, extended to 16-pixel tiles. Exclusive stop,
           ///< depth of the centre.
  gsplat,  ///< Footprint: box of min(3.33, sqrt(2 ln(255 opacity))) standard deviations, extended to
           ///< 16-pixel tiles. Exclusive stop, depth of the centre.
  habitat_gs,  ///< As inria, with opacity compensation of at least 0.005 for every set and near plane
               ///< 0.2.
};

}  // namespace gsnav
