// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav::eval {

/// Definition of the reference image. Quote it with every error figure.
enum class OracleKind : std::uint8_t {
  contract,     ///< The image contract: docs/reference/image_contract.md, "The image".
  untruncated,  ///< The contract without alpha_min and transmittance_min. max_alpha applies.
  ray,          ///< Maximum response along each pixel's ray. It shows the error of the EWA
                ///< approximation. The contract's near rules apply.
};

/// Order in which Gaussians are blended. Equal values are ordered by stable id (set, row).
enum class OracleOrder : std::uint8_t {
  own,          ///< The order of the kind: per_ray for OracleKind::ray, else float32_key.
  float32_key,  ///< The contract's order: the float32 key that renderers sort by.
  float64,      ///< The unrounded key in float64.
  per_ray,      ///< Per pixel, by the depth along its ray, as in depth images.
};

/// Half-open rectangle of pixels: [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< Bounds, pixels. x1 and y1 are excluded.

  /// Whether the rectangle has no pixels.
  bool empty() const noexcept { return x0 >= x1 || y0 >= y1; }
  /// Width in pixels, 0 if empty.
  std::size_t width() const noexcept { return empty() ? 0 : static_cast<std::size_t>(x1 - x0); }
  /// Height in pixels, 0 if empty.
  std::size_t height() const noexcept { return empty() ? 0 : static_cast<std::size_t>(y1 - y0); }
  /// Pixels that both rectangles have.
  PixelRect intersection(const PixelRect& o) const noexcept {
    return {std::max(x0, o.x0), std::max(y0, o.y0), std::min(x1, o.x1), std::min(y1, o.y1)};
  }
};

/// Transparent surface at one pixel.
struct OracleFragment {
  double depth = 0, alpha = 1;  ///< Planar z in metres, and alpha in [0, 1].
  Vec3d rgb{};                  ///< Colour, display-referred.
};

/// Image of a mesh for the reference renderer.
struct OracleMesh {
  std::vector<double> depth;  ///< Planar z, shape [height][width], metres. Infinity: no mesh.
  std::vector<double> rgb;    ///< Colour, shape [height][width][3], display-referred.
  /// Transparent surfaces in front of it, near to far, shape [height][width]. May be empty.
  std::vector<std::vector<OracleFragment>> fragments{};
};

/// Settings of the reference renderer.
struct OracleConfig {
  /// Settings of the image. `outputs`, `tuning` and `quality.exponential` are ignored: all images are
  /// produced, in float64, without tiles. `response` and `compat` must be those of the contract, and
  /// with a mesh also `composite` and `blend_space`.
  RenderConfig rules{};
  OracleKind kind = OracleKind::contract;  ///< Definition of the image.
  OracleOrder order = OracleOrder::own;    ///< Order of blending.
  /// True: evaluate each Gaussian only in the box where its alpha may reach the limit. For `contract`
  /// and `ray` the image is bit-identical to that without boxes. For `untruncated` it omits alpha <
  /// kNegligibleAlpha. False: evaluate every Gaussian at every pixel.
  bool boxed = true;
  PixelRect crop{};  ///< Part of the image to render. All 0: everything.
  /// Mesh to composite: it hides the Gaussians behind it and closes its pixels
  /// (docs/reference/composition.md). May be null. Must outlive the call.
  const OracleMesh* mesh = nullptr;
};

/// Base-2 logarithm of the alpha below which OracleKind::untruncated may omit a Gaussian, if
/// OracleConfig::boxed is set.
/// A pixel's colour is linear in each alpha, with a slope of at most c, the largest colour component
/// (background included). Omitting n Gaussians therefore changes the colour by less than n c 2^-40 and
/// alpha by less than n 2^-40, or 9.1e-7 c for a million.
inline constexpr double kLog2NegligibleAlpha = -40;
/// The alpha itself, 2^kLog2NegligibleAlpha.
inline constexpr double kNegligibleAlpha = 0x1p-40;

/// Margin within which float32 may rightly decide a comparison differently: relative distance of alpha
/// from alpha_min, and of T from transmittance_min.
inline constexpr double kUndecidedRelative = 1e-5;
/// The same for depths: absolute distance of T from the crossing that defines a depth.
inline constexpr double kUndecidedCrossing = 1e-3;
/// Margin between a Gaussian's depth along the ray and that of the mesh, metres.
inline constexpr double kUndecidedMesh = 1e-4;

/// Work that the reference image took.
struct OracleCounts {
  std::uint64_t gaussians = 0;    ///< Number of Gaussians in all sets.
  std::uint64_t visible = 0;      ///< Number of Gaussians whose box intersects the crop.
  std::uint64_t listed = 0;       ///< Number of (pixel, Gaussian) pairs listed. They are evaluated if
                                  ///< the pixel is open.
  std::uint64_t evaluations = 0;  ///< Number of pairs blended, which no renderer can avoid.
  std::uint64_t order_flips = 0;  ///< Number of pixels marked in order_flip.

  /// Adds the counts of another image.
  OracleCounts& operator+=(const OracleCounts& o) noexcept {
    gaussians += o.gaussians;
    visible += o.visible;
    listed += o.listed;
    evaluations += o.evaluations;
    order_flips += o.order_flips;
    return *this;
  }
};

/// Reference images of one camera or its crop, in float64, row-major from the top-left pixel. Masks are
/// 0 or 1.
struct OracleFrames {
  std::size_t width = 0, height = 0;      ///< Size of the images in pixels.
  std::vector<double> rgb;                ///< Shape [height][width][3], over the background, not
                                          ///< clamped.
  std::vector<double> alpha;              ///< Shape [height][width], 1 - transmittance.
  std::vector<double> median_depth;       ///< Shape [height][width], metres, where T crosses 1/2. 0: no
                                          ///< return.
  std::vector<double> expected_depth;     ///< Shape [height][width], metres, sum(w z) / sum(w). 0 if
                                          ///< sum(w) = 0.
  std::vector<double> accumulated_depth;  ///< Shape [height][width], metres, sum(w z).
  std::vector<double> first_hit_depth;    ///< Shape [height][width], metres, where alpha reaches
                                          ///< first_hit_tau. 0: never.
  /// 1 if float32 may rightly give another colour: before the stop, a Gaussian has alpha within
  /// kUndecidedRelative of alpha_min, or it takes T within kUndecidedRelative of transmittance_min, or
  /// it lies within kUndecidedMesh of the mesh.
  std::vector<std::uint8_t> undecided;
  /// 1 if a Gaussian takes T within kUndecidedCrossing of 1/2 or of 1 - first_hit_tau.
  std::vector<std::uint8_t> undecided_depth;
  /// 1 if sorting by the other key would blend the Gaussians of this pixel in another order. The other
  /// key is the float64 one if the image uses the float32 one, and vice versa. The test is exact,
  /// because a list is out of order if and only if two neighbours are.
  std::vector<std::uint8_t> order_flip;
  OracleCounts counts;  ///< Work that the images took.

  /// Sets the size and fills all images with zeros.
  void resize(std::size_t w, std::size_t h) {
    width = w;
    height = h;
    rgb.assign(3 * w * h, 0.0);
    for (auto* image : {&alpha, &median_depth, &expected_depth, &accumulated_depth, &first_hit_depth}) {
      image->assign(w * h, 0.0);
    }
    for (auto* mask : {&undecided, &undecided_depth, &order_flip}) mask->assign(w * h, 0);
  }
};

/// Checks the settings.
/// @return invalid_argument or unsupported, with the field.
inline Status validate(const OracleConfig& c, const Camera& camera) {
  if (Status s = gsnav::validate(c.rules); !s) return s;
  if (Status s = gsnav::validate(camera); !s) return s;
  if (c.rules.response != Response::ewa) {
    return {Errc::unsupported,
            "OracleConfig.rules.response: must be Response::ewa; OracleKind::ray is the exact "
            "response"};
  }
  if (c.rules.compat != Compat::none) {
    return {Errc::unsupported,
            "OracleConfig.rules.compat: no kind of oracle has other renderers' rules"};
  }
  if (c.mesh != nullptr && c.rules.composite != Composite::merged) {
    return {Errc::unsupported,
            "OracleConfig.rules.composite: oracles merge meshes among Gaussians only"};
  }
  if (c.mesh != nullptr && c.rules.blend_space != ColorSpace::display) {
    return {Errc::unsupported, "OracleConfig.rules.blend_space: a mesh's colours are display-referred"};
  }
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  if (c.mesh != nullptr && (c.mesh->depth.size() != pixels || c.mesh->rgb.size() != 3 * pixels)) {
    return {Errc::invalid_argument,
            "OracleConfig.mesh: its images must have the size of the camera's image"};
  }
  if (c.mesh != nullptr && !c.mesh->fragments.empty()) {
    if (c.mesh->fragments.size() != pixels) {
      return {Errc::invalid_argument, "OracleConfig.mesh.fragments: not of the camera's image"};
    }
    if (c.kind == OracleKind::ray || c.order == OracleOrder::per_ray) {
      return {Errc::unsupported,
              "OracleConfig.mesh.fragments: among Gaussians in the order of keys only"};
    }
  }
  const PixelRect& r = c.crop;
  const bool whole = r.x0 == 0 && r.y0 == 0 && r.x1 == 0 && r.y1 == 0;
  if (!whole && (r.empty() || r.x0 < 0 || r.y0 < 0 || r.x1 > camera.width || r.y1 > camera.height)) {
    return {Errc::invalid_argument, std::string("OracleConfig.crop = [") + std::to_string(r.x0) + ", " +
                                        std::to_string(r.x1) + ") x [" + std::to_string(r.y0) + ", " +
                                        std::to_string(r.y1) +
                                        "): must hold a pixel and lie inside the image, or be all 0"};
  }
  return {};
}

/// Pixels to render.
inline PixelRect oracle_rect(const OracleConfig& c, const Camera& camera) noexcept {
  return c.crop.empty() ? PixelRect{0, 0, camera.width, camera.height} : c.crop;
}

}  // namespace gsnav::eval
