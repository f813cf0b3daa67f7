// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

// Bounds of footprints in float, from the largest standard deviation alone. They cost less than
// `project` and are never smaller than its bounds. Response::ewa only.

namespace gsnav {

/// Box of means, and a bound of their footprints.
struct RoughBox {
  Vec3<float> center, half;
  float reach;  ///< Largest product of a standard deviation and a footprint's radius. Negative: none
                ///< can be visible.
};

/// A camera as seen from a set: four planes through it near the edges of the image, and constants for
/// bounds of single rows. Lengths are in asset units.
struct RoughView {
  Vec3<float> plane[4];      ///< Left, right, top, bottom. Pixels times depth: positive inside.
  float wide[4];             ///< Pixels times depth per unit of reach.
  float slack[4];            ///< Pixels times depth per unit of distance: bound of rounding errors.
  Vec3<float> axis;          ///< View axis.
  float nearest;             ///< Depth of the near plane.
  float limit2_x, limit2_y;  ///< Squares of the limits of x/z and y/z in the Jacobian.
  float inverse_scale;       ///< Asset units per metre.
  float rounding;            ///< Rounding error of a pixel, per unit of 1 + |x/z| + |y/z|.

  /// Host code.
  /// @param radius2 squared radius of the largest footprint, in standard deviations
  static RoughView of(const ProjectionCamera<double>& c, double radius2) noexcept {
    RoughView v{};
    const double fixed = sqrt(c.eps2d * radius2) + 0.05;
    const ImageAxis axes[2] = {c.image_axis(0), c.image_axis(1)};
    for (int i = 0; i < 4; ++i) {
      const ImageAxis& axis = axes[i / 2];
      const ImageSide<double> side = i % 2 == 0 ? axis.first_side(fixed) : axis.last_side(fixed);
      v.plane[i] = vec_cast<float>(axis.normal(side, c.rotation.row[2]));
      v.wide[i] = static_cast<float>(1.05 * abs(axis.f) * axis.slant());
      v.slack[i] = static_cast<float>(1e-5 * (abs(axis.f) + abs(side.ahead) + axis.extent));
    }
    v.axis = vec_cast<float>(c.rotation.row[2]);
    v.nearest = static_cast<float>(c.near_plane / c.scale * (1 - 1e-6));
    v.limit2_x = static_cast<float>(axes[0].limit * axes[0].limit * 1.00001);
    v.limit2_y = static_cast<float>(axes[1].limit * axes[1].limit * 1.00001);
    v.inverse_scale = static_cast<float>(1 / c.scale);
    v.rounding = static_cast<float>((abs(c.fx) + abs(c.fy)) * 4e-6);
    return v;
  }
};

/// True if a footprint of the box may be visible. `depth` becomes the depth of the box's centre.
/// @param offset of the means, relative to the camera
GSNAV_HD bool may_be_visible(const RoughView& v, const RoughBox& box, const Vec3<float>& offset,
                             float& depth) noexcept {
  const Vec3<float> c = box.center + offset;
  float size = 0;
  for (int k = 0; k < 3; ++k) size += abs(c[k]) + box.half[k] + abs(offset[k]);
  const auto largest = [&](const Vec3<float>& n) GSNAV_INLINED {
    float sum = 0;
    for (int k = 0; k < 3; ++k) sum = fma(n[k], c[k], fma(abs(n[k]), box.half[k], sum));
    return sum;
  };
  bool visible = largest(v.axis) + fma(size, 2e-6f, 1e-5f) > v.nearest;
  for (int i = 0; i < 4; ++i) {
    visible = visible && largest(v.plane[i]) + fma(v.wide[i], box.reach, v.slack[i] * size) >= 0;
  }
  depth = fma(v.axis.x, c.x, fma(v.axis.y, c.y, v.axis.z * c.z));
  return visible;
}

/// Bounds of a footprint, in pixels.
struct RoughFootprint {
  float mean_x, mean_y;  ///< Half a pixel to the right of and below the mean.
  float half_width, half_height;
};

/// Pixels that a footprint may cover, as a centre and half sizes. Never less than those of `project`.
/// @param v the camera of the footprint's set
/// @param lens focal lengths fx, fy, principal point cx, cy (pixels) and the dilation eps2d (px^2)
/// @param point mean in camera axes, asset units
/// @param scale largest standard deviation
/// @param radius2 squared radius of the footprint, in standard deviations
template <class Lens>
GSNAV_HD RoughFootprint rough_footprint(const RoughView& v, const Lens& lens, const Vec3<float>& point,
                                        float scale, float radius2) noexcept {
  const float inv_z = reciprocal_near(point.z);
  const float u = point.x * inv_z, w = point.y * inv_z, angle = scale * inv_z;
  const auto half = [&](float s, float tangent, float limit2) GSNAV_INLINED {
    const float variance = fma(s * s, 1.0f + min(tangent * tangent, limit2), lens.eps2d);
    return sqrt_above(radius2 * variance) * fma(s, 2e-6f, 1.0005f);
  };
  // |point| <= z (1 + |u| + |w|): a bound of rounding errors.
  const float margin = fma(abs(u) + abs(w), v.rounding, 0.02f + v.rounding);
  return {fma(lens.fx, u, lens.cx + 0.5f), fma(lens.fy, w, lens.cy + 0.5f),
          half(lens.fx * angle, u, v.limit2_x) + margin, half(lens.fy * angle, w, v.limit2_y) + margin};
}

}  // namespace gsnav
