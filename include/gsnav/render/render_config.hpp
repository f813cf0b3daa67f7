// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/projection.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav {

/// How much accuracy is traded for speed. Budgets against the float64 contract image are in
/// docs/accuracy.md.
enum class Profile {
  exact,  ///< rounding only
  fast,   ///< exp2 by a cubic: alpha within 1.0e-4 relative
};

/// What to render and by which rules. Defaults are the contract's.
struct RenderConfig {
  unsigned outputs = kRgb | kAlpha | kMedianDepth;
  Profile profile = Profile::exact;
  SortOrder sort_order = SortOrder::z_depth;
  Response response = Response::ewa;
  Compat compat = Compat::none;
  int tile_size = 0;     ///< 8, 16 or 32, or 0: what is fast; the image does not depend on it
  int depth_slices = 0;  ///< in [1, 8], or 0: what is fast; the image does not depend on it. Some
                         ///< backends draw so many one after the other and skip what earlier ones hide
  int max_sh_degree = kMaxShDegree;  ///< in [0, 3]: bands above it are left out
  int key_bits = 32;                 ///< in [8, 32]: how much of the sort key is compared
  double alpha_min = 1.0 / 255;      ///< in (0, 1): a Gaussian is not blended where alpha is below
  double max_alpha = 0.99;           ///< in (0, 1]
  double transmittance_min = 1e-4;   ///< in [0, 1)
  double first_hit_tau = 0.5;        ///< in (0, 1): first-hit depth is where alpha reaches this
  /// What colours are blended in, and images and `background` hold: the main asset's space. Sets of the
  /// other are converted Gaussian by Gaussian, after SH; meshes too. Linear images need encoding to be
  /// looked at (srgb_encoded).
  ColorSpace blend_space = ColorSpace::display;
  Vec3d background{0, 0, 0};                ///< of blend_space
  Composite composite = Composite::merged;  ///< of Gaussians and meshes, where a frame has both

  bool operator==(const RenderConfig&) const = default;
};

/// Side of the tiles that an image is rendered in. On a processor large images have tiles of 32 pixels:
/// their footprints are large too, and take fewer of those.
template <Backend B>
int tile_size_of(const RenderConfig& c, int width, int height) noexcept {
  if (c.tile_size != 0) return c.tile_size;
  constexpr std::int64_t kLarge = 1000000;
  const bool large = std::int64_t{width} * height >= kLarge;
  return is_host_backend<B> && large && c.compat == Compat::none ? 32 : 16;
}

/// Names the field that cannot be, or ok.
inline Status validate(const RenderConfig& c) {
  const auto bad = [](const char* field, const std::string& value, const char* rule) {
    return Status(Errc::invalid_argument,
                  std::string("RenderConfig.") + field + " = " + value + ": " + rule);
  };
  if (c.outputs == 0 || (c.outputs & ~(kRgb | kAlpha | kAnyDepth)) != 0) {
    return bad("outputs", std::to_string(c.outputs), "name at least one known output");
  }
  const auto unknown = [&](const char* field, auto value) {
    return bad(field, std::to_string(static_cast<int>(value)), "there is none of this number");
  };
  if (c.profile != Profile::exact && c.profile != Profile::fast) return unknown("profile", c.profile);
  if (c.sort_order > SortOrder::camera_distance) return unknown("sort_order", c.sort_order);
  if (c.response > Response::ray) return unknown("response", c.response);
  if (c.compat > Compat::habitat_gs) return unknown("compat", c.compat);
  if (c.blend_space > ColorSpace::linear) return unknown("blend_space", c.blend_space);
  if (c.composite > Composite::hard_depth) return unknown("composite", c.composite);
  if (c.tile_size != 0 && c.tile_size != 8 && c.tile_size != 16 && c.tile_size != 32) {
    return bad("tile_size", std::to_string(c.tile_size), "must be 8, 16 or 32, or 0 for what is fast");
  }
  if (c.compat != Compat::none && c.tile_size == 32) {
    return bad("tile_size", "32", "compat modes have tiles of 16 pixels: use 8 or 16");
  }
  if (c.compat != Compat::none && c.response != Response::ewa) {
    return bad("response", std::to_string(static_cast<int>(c.response)), "compat modes know ewa only");
  }
  if (c.depth_slices < 0 || c.depth_slices > 8) {
    return bad("depth_slices", std::to_string(c.depth_slices),
               "must be in [1, 8], or 0 for what is fast");
  }
  if (c.max_sh_degree < 0 || c.max_sh_degree > kMaxShDegree) {
    return bad("max_sh_degree", std::to_string(c.max_sh_degree), "must be in [0, 3]");
  }
  if (c.key_bits < 8 || c.key_bits > 32) {
    return bad("key_bits", std::to_string(c.key_bits), "must be in [8, 32]");
  }
  if (!(c.alpha_min > 0 && c.alpha_min < 1)) {
    return bad("alpha_min", std::to_string(c.alpha_min), "must be in (0, 1)");
  }
  if (!(c.max_alpha > 0 && c.max_alpha <= 1)) {
    return bad("max_alpha", std::to_string(c.max_alpha), "must be in (0, 1]");
  }
  if (!(c.transmittance_min >= 0 && c.transmittance_min < 1)) {
    return bad("transmittance_min", std::to_string(c.transmittance_min), "must be in [0, 1)");
  }
  if (!(c.first_hit_tau > 0 && c.first_hit_tau < 1)) {
    return bad("first_hit_tau", std::to_string(c.first_hit_tau), "must be in (0, 1)");
  }
  if (!is_finite(c.background)) return bad("background", "not finite", "must be finite");
  return {};
}

/// The part of the rules that projection reads.
inline ProjectionRules projection_rules(const RenderConfig& c) noexcept {
  return {c.sort_order, c.response, c.compat, c.alpha_min, c.key_bits};
}

/// The part that blending reads, rounded to the scalar of the kernel.
template <class S>
BlendRules<S> blend_rules(const RenderConfig& c) noexcept {
  BlendRules<S> r;
  r.max_alpha = static_cast<S>(c.max_alpha);
  r.transmittance_min = static_cast<S>(c.transmittance_min);
  r.first_hit_tau = static_cast<S>(c.first_hit_tau);
  // What float's exp2 reaches.
  r.log2_alpha_min = static_cast<S>(std::max(std::log2(c.alpha_min), -126.0));
  r.exclusive_stop = c.compat != Compat::none;
  // gsplat stops at T <= T_min where INRIA stops at T < T_min.
  if (c.compat == Compat::gsplat) r.transmittance_min = std::nextafter(r.transmittance_min, S(1));
  if (c.compat == Compat::habitat_gs) r.return_alpha = S(0.01);
  return r;
}

/// The same for a frame of these images: where no colour and no alpha are asked for, and of depths only
/// those that a transmittance decides, a pixel is closed once it has them. The images keep their bits.
template <class S>
BlendRules<S> blend_rules(const RenderConfig& c, const FrameImages<S>& images) noexcept {
  BlendRules<S> r = blend_rules<S>(c);
  const bool sums = images.rgb != nullptr || images.alpha != nullptr ||
                    images.expected_depth != nullptr || images.accumulated_depth != nullptr;
  if (sums || c.compat != Compat::none) return r;
  S needed(1);
  if (images.median_depth != nullptr) needed = S(0.5);
  if (images.first_hit_depth != nullptr) needed = std::min(needed, S(1) - r.first_hit_tau);
  r.transmittance_min = std::max(r.transmittance_min, needed);
  return r;
}

/// Largest image side; tile counts and pixel offsets stay well inside their types.
inline constexpr int kMaxImageSide = 16384;

/// Names the field that cannot be, or ok.
inline Status validate(const Camera& c) {
  const auto bad = [](const char* field, const std::string& value, const char* rule) {
    return Status(Errc::invalid_argument, std::string("Camera.") + field + " = " + value + ": " + rule);
  };
  if (c.width < 1 || c.width > kMaxImageSide) {
    return bad("width", std::to_string(c.width), "must be in [1, 16384]");
  }
  if (c.height < 1 || c.height > kMaxImageSide) {
    return bad("height", std::to_string(c.height), "must be in [1, 16384]");
  }
  if (!(c.fx > 0 && is_finite(c.fx))) return bad("fx", std::to_string(c.fx), "must be positive");
  if (!(c.fy > 0 && is_finite(c.fy))) return bad("fy", std::to_string(c.fy), "must be positive");
  if (!is_finite(c.cx)) return bad("cx", std::to_string(c.cx), "must be finite");
  if (!is_finite(c.cy)) return bad("cy", std::to_string(c.cy), "must be finite");
  if (!(c.near_plane > 0 && is_finite(c.near_plane))) {
    return bad("near_plane", std::to_string(c.near_plane), "must be positive");
  }
  if (!(c.near_sigma >= 0 && is_finite(c.near_sigma))) {
    return bad("near_sigma", std::to_string(c.near_sigma), "must be >= 0");
  }
  if (!is_finite(c.viewmat.translation)) {
    return bad("viewmat", "a translation that is not finite", "must be finite");
  }
  const Mat3d gram = c.viewmat.linear * transpose(c.viewmat.linear);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (!(abs(gram(i, j) - (i == j ? 1.0 : 0.0)) < 1e-3)) {
        return bad("viewmat", "a linear part that is no rotation", "must be rigid (within 1e-3)");
      }
    }
  }
  const auto& m = c.viewmat.linear;
  if (dot(m.row[0], cross(m.row[1], m.row[2])) < 0) {
    return bad("viewmat", "a linear part with determinant -1",
               "must not mirror (from OpenGL's axes negate both y and z)");
  }
  return {};
}

}  // namespace gsnav
