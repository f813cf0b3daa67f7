// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/render/render.hpp"

namespace gsnav::eval {

/// What the image of a set of Gaussians is taken to be. An error figure names the kind it is against.
enum class OracleKind : std::uint8_t {
  contract,     ///< docs/reference/image_contract.md, "The image"
  untruncated,  ///< the contract without alpha_min and transmittance_min; max_alpha stays
  ray,          ///< maximum response along each pixel's ray: the model error of EWA. Near rules stay
};

/// What decides which Gaussian is in front. Ties go by stable id (set, row).
enum class OracleOrder : std::uint8_t {
  own,          ///< the kind's: float32_key, but per_ray for OracleKind::ray
  float32_key,  ///< the contract's: the very key that renderers sort by
  float64,      ///< the same quantity in float64
  per_ray,      ///< at each pixel by the depth along its ray, the one that depth images show
};

/// Half-open rectangle of pixels [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< Corners in pixels.

  /// Whether it has no pixels.
  bool empty() const noexcept { return x0 >= x1 || y0 >= y1; }
  /// Width in pixels.
  std::size_t width() const noexcept { return empty() ? 0 : static_cast<std::size_t>(x1 - x0); }
  /// Height in pixels.
  std::size_t height() const noexcept { return empty() ? 0 : static_cast<std::size_t>(y1 - y0); }
  /// The pixels that are in both.
  PixelRect intersection(const PixelRect& o) const noexcept {
    return {max(x0, o.x0), max(y0, o.y0), min(x1, o.x1), min(y1, o.y1)};
  }
};

/// A surface that is seen through, at one pixel.
struct OracleFragment {
  double depth = 0, alpha = 1;  ///< planar z, metres; in [0, 1]
  Vec3d rgb{};                  ///< display-referred
};

/// A mesh as an oracle takes it: what each pixel of the camera's image shows of it.
struct OracleMesh {
  std::vector<double> depth;  ///< [H][W] planar z, metres; infinity: none
  std::vector<double> rgb;    ///< [H][W][3], display-referred
  /// [H][W], what is before that, near to far; or empty
  std::vector<std::vector<OracleFragment>> fragments{};
};

/// Which oracle, by which rules.
struct OracleConfig {
  /// Rules of the image. `outputs`, `tuning` and `quality.exponential` mean nothing here: every image is
  /// made, in float64, without tiles. `response` and `compat` must be the contract's, and where there is
  /// a mesh `composite` and `blend_space` too.
  RenderConfig rules{};
  OracleKind kind = OracleKind::contract;  ///< Definition of the image.
  OracleOrder order = OracleOrder::own;    ///< Order of the Gaussians.
  /// true: each Gaussian is asked only at the pixels of the box where its alpha may pass; for `contract`
  /// and `ray` the image is that of false, bit for bit. false: every Gaussian at every pixel.
  /// `untruncated` with boxes leaves alpha < kNegligibleAlpha out.
  bool boxed = true;
  PixelRect crop{};  ///< what to render of the camera's image; all 0: everything
  /// Hides the Gaussians behind it and closes its pixels (docs/reference/composition.md). Null: none.
  /// Must outlive the call.
  const OracleMesh* mesh = nullptr;
};

/// Below this the boxes of OracleKind::untruncated leave a Gaussian out. A pixel's colour is linear in
/// each alpha with a slope of at most c, the largest colour component (background included), so n
/// Gaussians left out move it by less than n c 2^-40 and its alpha by n 2^-40: 9.1e-7 c for a million.
inline constexpr double kLog2NegligibleAlpha = -40;
inline constexpr double kNegligibleAlpha = 0x1p-40;  ///< 2 to the power of kLog2NegligibleAlpha.

/// Where float32 may rightly take the other side of a comparison: relative distance of a float64 alpha
/// from alpha_min and of T from the stop; absolute distance of T from a depth's crossing.
inline constexpr double kUndecidedRelative = 1e-5;
/// Absolute distance of a transmittance from a depth's crossing.
inline constexpr double kUndecidedCrossing = 1e-3;
/// And of a Gaussian's depth along the ray from the mesh's, metres.
inline constexpr double kUndecidedMesh = 1e-4;

/// What an oracle's image was made of.
struct OracleCounts {
  std::uint64_t gaussians = 0;    ///< in all sets
  std::uint64_t visible = 0;      ///< whose box reaches the crop
  std::uint64_t listed = 0;       ///< (pixel, Gaussian) pairs that were asked, if the pixel was open
  std::uint64_t evaluations = 0;  ///< pairs blended: what a renderer cannot do without
  std::uint64_t order_flips = 0;  ///< pixels marked in order_flip

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

/// Images of one camera (or its crop) in float64, row-major from the top-left pixel. Masks: 0 or 1.
struct OracleFrames {
  std::size_t width = 0, height = 0;      ///< Size in pixels.
  std::vector<double> rgb;                ///< [H][W][3], over the background, unclamped
  std::vector<double> alpha;              ///< [H][W], 1 - transmittance
  std::vector<double> median_depth;       ///< [H][W] metres, where T crosses 1/2; 0: no return
  std::vector<double> expected_depth;     ///< [H][W] metres, sum(w z) / sum(w); 0 where sum(w) = 0
  std::vector<double> accumulated_depth;  ///< [H][W] metres, sum(w z)
  std::vector<double> first_hit_depth;    ///< [H][W] metres, where alpha reaches first_hit_tau; 0: never
  /// A Gaussian met before the stop has alpha within kUndecidedRelative of alpha_min, or one takes T
  /// within kUndecidedRelative of transmittance_min, or one lies within kUndecidedMesh of the mesh.
  std::vector<std::uint8_t> undecided;
  /// A Gaussian takes T within kUndecidedCrossing of 1/2 or of 1 - first_hit_tau.
  std::vector<std::uint8_t> undecided_depth;
  /// The Gaussians blended here stand in another order by float64 (where the image is by the float32
  /// key) or by the float32 key (where it is by anything else). Exact: a list is out of order if and
  /// only if two neighbours in it are.
  std::vector<std::uint8_t> order_flip;
  OracleCounts counts;  ///< What the image was made of.

  /// Sets the size and clears all images.
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

/// Names the field that cannot be, or ok.
inline Status validate(const OracleConfig& c, const Camera& camera) {
  if (Status s = gsnav::validate(c.rules); !s) return s;
  if (Status s = gsnav::validate(camera); !s) return s;
  if (c.rules.response != Response::ewa) {
    return {Errc::unsupported,
            "OracleConfig.rules.response: oracles know Response::ewa only; OracleKind::ray is the exact "
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
    return {Errc::invalid_argument, "OracleConfig.mesh: its planes are not of the camera's image"};
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

/// The pixels that a config asks for.
inline PixelRect oracle_rect(const OracleConfig& c, const Camera& camera) noexcept {
  return c.crop.empty() ? PixelRect{0, 0, camera.width, camera.height} : c.crop;
}

}  // namespace gsnav::eval
