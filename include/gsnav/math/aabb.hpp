// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Axis-aligned box; empty (low > high) until the first point is added.
template <class S>
struct Aabb {
  /// Lower corner.
  Vec3<S> low{std::numeric_limits<S>::max(), std::numeric_limits<S>::max(),
              std::numeric_limits<S>::max()};
  /// Upper corner.
  Vec3<S> high{std::numeric_limits<S>::lowest(), std::numeric_limits<S>::lowest(),
               std::numeric_limits<S>::lowest()};

  /// Whether it has no points.
  GSNAV_HD bool empty() const noexcept { return low.x > high.x; }
  /// Grows to hold a point.
  GSNAV_HD void add(const Vec3<S>& p) noexcept {
    low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
    high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
  }
  /// Grows to hold another box.
  GSNAV_HD void add(const Aabb& b) noexcept {
    if (!b.empty()) {
      add(b.low);
      add(b.high);
    }
  }
};

}  // namespace gsnav
