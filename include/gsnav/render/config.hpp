// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/frame/blend.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/detail/image/validate_camera.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/detail/render/quality.hpp"
#include "gsnav/detail/render/tuning.hpp"
#include "gsnav/frame/compat.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Settings of a frame: what the image is, how exact it is, how it is computed. The defaults are the
/// contract's (docs/accuracy.md).
struct RenderConfig {
  /// Images to make. Calls that are given a FrameImages make those that it points to, and do not read
  /// this.
  unsigned outputs = kRgb | kAlpha | kMedianDepth;
  SortOrder sort_order = SortOrder::z_depth;  ///< Quantity that Gaussians are sorted by.
  Response response = Response::ewa;          ///< How a Gaussian spreads over the image.
  double first_hit_tau = 0.5;                 ///< in (0, 1): first-hit depth is where alpha reaches this
  /// What colours are blended in, and images and `background` hold: the main asset's space. Sets of the
  /// other are converted Gaussian by Gaussian, after SH; meshes too. Linear images need encoding to be
  /// looked at (srgb_encoded).
  ColorSpace blend_space = ColorSpace::display;
  Vec3d background{0, 0, 0};                ///< of blend_space
  Composite composite = Composite::merged;  ///< of Gaussians and meshes, where a frame has both
  Quality quality{};                        ///< How exact the image is.
  Tuning tuning{};                          ///< How the image is computed; it does not change the image.
  Compat compat = Compat::none;             ///< Whose rules the image follows.

  bool operator==(const RenderConfig&) const = default;
};

/// invalid_argument, naming the field, or ok.
inline Status validate(const RenderConfig& c) {
  const BadArgument bad{"RenderConfig."};
  if (c.outputs == 0 || (c.outputs & ~kAllOutputs) != 0) {
    return bad("outputs", c.outputs, "name at least one known output");
  }
  const auto unknown = [&](const char* field, auto value) {
    return bad(field, static_cast<int>(value), "there is none of this number");
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
