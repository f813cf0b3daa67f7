// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/frame/output.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Method of computing 2^x for the alpha of a Gaussian at a pixel.
enum class Exponential {
  exact,  ///< Only rounding errors.
  fast,   ///< A cubic: alpha within 1.0e-4 relative. On a GPU the hardware instruction, within 2e-7.
};

/// The settings of RenderConfig that trade accuracy for speed. docs/reference/image_contract.md has the
/// error budgets, measured against the float64 contract image.
struct Quality {
  /// Frames with meshes always use Exponential::exact.
  Exponential exponential = Exponential::exact;
  /// Skip a Gaussian at a pixel where its alpha is lower. Range (0, 1); values below 2^-126 act as
  /// 2^-126.
  double alpha_min = kAlphaMin;
  double max_alpha = kMaxAlpha;  ///< upper limit of a Gaussian's alpha, in (0, 1]
  /// Stop blending a pixel once its transmittance is lower. Range [0, 1).
  double transmittance_min = kTransmittanceMin;
  /// Treat a closed pixel as opaque: divide its colour and its accumulated depth by its alpha, then set
  /// its alpha to 1. The background does not show through it. A mesh behind the pixel takes the
  /// remaining transmittance before that, so nothing is divided there. Ignored with a Compat.
  bool normalize_closed = false;
  int max_sh_degree = kMaxShDegree;  ///< highest SH degree to evaluate, 0 to 3
  int key_bits = 32;                 ///< bits of the depth key that sorting compares, 8 to 32

  /// The contract: float32 rounding is the only error.
  static constexpr Quality exact() noexcept { return {}; }
  /// Exponential::fast; blending stops at a transmittance of 1/1000, and closed pixels are normalized.
  static constexpr Quality fast() noexcept {
    Quality q;
    q.exponential = Exponential::fast;
    q.transmittance_min = 1e-3;
    q.normalize_closed = true;
    return q;
  }
  bool operator==(const Quality&) const = default;
};

/// Checks all fields.
/// @return invalid_argument naming the field.
inline Status validate(const Quality& q) {
  const BadArgument bad{"RenderConfig.quality."};
  if (q.exponential != Exponential::exact && q.exponential != Exponential::fast) {
    return bad("exponential", std::to_string(static_cast<int>(q.exponential)),
               "must be a value of the enumeration");
  }
  if (q.max_sh_degree < 0 || q.max_sh_degree > kMaxShDegree) {
    return bad("max_sh_degree", q.max_sh_degree, "must be in [0, 3]");
  }
  if (q.key_bits < 8 || q.key_bits > 32) return bad("key_bits", q.key_bits, "must be in [8, 32]");
  if (!(q.alpha_min > 0 && q.alpha_min < 1)) return bad("alpha_min", q.alpha_min, "must be in (0, 1)");
  if (!(q.max_alpha > 0 && q.max_alpha <= 1)) return bad("max_alpha", q.max_alpha, "must be in (0, 1]");
  if (!(q.transmittance_min >= 0 && q.transmittance_min < 1)) {
    return bad("transmittance_min", q.transmittance_min, "must be in [0, 1)");
  }
  return {};
}

/// The settings of RenderConfig that change no bit of an image. A renderer may ignore them.
struct Tuning {
  int tile_size = 0;  ///< Tile width in pixels: 8, 16 or 32, or 0 to choose by the image's size.
  static constexpr int kMostDepthSlices = 16;  ///< Upper limit of depth_slices.
  int depth_slices = 0;  ///< Number of front-to-back passes, 1 to 16, or 0 to choose automatically.
                         ///< Later passes skip what earlier ones hide. Only for backends that can slice
                         ///< (OpenMP).
  bool operator==(const Tuning&) const = default;
};

/// Checks all fields.
/// @return invalid_argument naming the field.
inline Status validate(const Tuning& t) {
  const BadArgument bad{"RenderConfig.tuning."};
  if (t.tile_size != 0 && t.tile_size != 8 && t.tile_size != 16 && t.tile_size != 32) {
    return bad("tile_size", t.tile_size, "must be 8, 16 or 32, or 0 to choose");
  }
  if (t.depth_slices < 0 || t.depth_slices > Tuning::kMostDepthSlices) {
    return bad("depth_slices", t.depth_slices, "must be in [1, 16], or 0 to choose");
  }
  return {};
}

/// Settings of one frame: images to make, image quality, and how the frame is computed. The defaults
/// follow the image contract (docs/reference/image_contract.md).
struct RenderConfig {
  /// Images to make, a bitmask of kRgb, kAlpha, kMedianDepth, ... Ignored by calls that take a
  /// FrameImages: those make the images it points to.
  unsigned outputs = kRgb | kAlpha | kMedianDepth;
  SortOrder sort_order = SortOrder::z_depth;  ///< key by which Gaussians are sorted
  Response response = Response::ewa;          ///< how a Gaussian spreads over the image
  double first_hit_tau = kFirstHitTau;  ///< First-hit depth is taken where accumulated alpha reaches
                                        ///< this. Range (0, 1).
  /// Color space in which Gaussians and meshes are blended; images and `background` use it too. Sets
  /// stored in the other space are converted per Gaussian, after SH evaluation. Convert linear images
  /// with srgb_encoded before you view them.
  ColorSpace blend_space = ColorSpace::display;
  Vec3d background{0, 0, 0};                ///< colour behind everything, in blend_space
  Composite composite = Composite::merged;  ///< Rule by which Gaussians and meshes are combined in
                                            ///< frames that have both.
  Quality quality{};             ///< error budget: exact, fast, ... (docs/reference/image_contract.md)
  Tuning tuning{};               ///< Settings that affect speed only. They change no bit of the image.
  Compat compat = Compat::none;  ///< another renderer's rules, for parity tests

  /// True if all settings are equal.
  bool operator==(const RenderConfig&) const = default;
};

/// Checks all fields.
/// @return invalid_argument naming the field if one is out of range.
inline Status validate(const RenderConfig& c) {
  const BadArgument bad{"RenderConfig."};
  if (c.outputs == 0 || (c.outputs & ~kAllOutputs) != 0) {
    return bad("outputs", c.outputs, "name at least one known output");
  }
  const auto unknown = [&](const char* field, auto value) {
    return bad(field, static_cast<int>(value), "must be a value of the enumeration");
  };
  if (c.sort_order > SortOrder::camera_distance) return unknown("sort_order", c.sort_order);
  if (c.response > Response::ray) return unknown("response", c.response);
  if (c.compat > Compat::habitat_gs) return unknown("compat", c.compat);
  if (c.blend_space > ColorSpace::linear) return unknown("blend_space", c.blend_space);
  if (c.composite > Composite::hard_depth) return unknown("composite", c.composite);
  if (Status s = validate(c.quality); !s) return s;
  if (Status s = validate(c.tuning); !s) return s;
  if (!(c.first_hit_tau > 0 && c.first_hit_tau < 1)) {
    return bad("first_hit_tau", c.first_hit_tau, "must be in (0, 1)");
  }
  if (!is_finite(c.background)) return bad("background", "not finite", "must be finite");
  if (c.compat != Compat::none && c.tuning.tile_size == 32) {
    return bad("tuning.tile_size", "32", "compat modes have tiles of 16 pixels: use 8 or 16");
  }
  if (c.compat != Compat::none && c.response != Response::ewa) {
    return bad("response", static_cast<int>(c.response), "compat modes know ewa only");
  }
  return {};
}

}  // namespace gsnav
