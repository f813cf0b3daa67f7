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

/// Settings of one frame: images to make, image quality, and how the frame is computed. The defaults
/// follow the image contract (docs/reference/image_contract.md).
struct RenderConfig {
  /// Images to make, a bitmask of kRgb, kAlpha, kMedianDepth, ... Ignored by calls that take a
  /// FrameImages: those make the images it points to.
  unsigned outputs = kRgb | kAlpha | kMedianDepth;
  SortOrder sort_order = SortOrder::z_depth;  ///< key by which Gaussians are sorted
  Response response = Response::ewa;          ///< how a Gaussian spreads over the image
  double first_hit_tau = 0.5;  ///< First-hit depth is taken where accumulated alpha reaches this. Range
                               ///< (0, 1).
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
