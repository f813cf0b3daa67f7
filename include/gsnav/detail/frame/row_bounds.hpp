// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/frame/gaussians.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Collects the bounds of a chunk or part, row by row. Without rows they are zero.
class RowBounds {
 public:
  /// @param mean metres, asset frame
  /// @param scales standard deviations, metres
  /// @param opacity in [0, 1]
  GSNAV_HD void add(const Vec3d& mean, const Vec3<float>& scales, float opacity) noexcept {
    means_.add(mean);
    add_size(scales, opacity);
  }
  /// Adds a row whose mean may be off by `pad` along each axis, metres.
  GSNAV_HD void add(const Vec3d& mean, const Vec3d& pad, const Vec3<float>& scales,
                    float opacity) noexcept {
    means_.add(Aabb<double>{mean - pad, mean + pad});
    add_size(scales, opacity);
  }
  GSNAV_HD ChunkBounds bounds() const noexcept {
    if (means_.empty()) return {};
    return {means_.low, means_.high, scale_max_, opacity_max_};
  }

 private:
  GSNAV_HD void add_size(const Vec3<float>& scales, float opacity) noexcept {
    for (int k = 0; k < 3; ++k) scale_max_ = max(scale_max_, scales[k]);
    opacity_max_ = max(opacity_max_, opacity);
  }

  Aabb<double> means_;
  float scale_max_ = 0, opacity_max_ = 0;
};

}  // namespace gsnav
