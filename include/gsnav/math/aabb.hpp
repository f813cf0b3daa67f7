// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Axis-aligned box. It is empty (low > high) until the first point is added.
template <class S>
struct Aabb {
  /// Smallest coordinates.
  Vec3<S> low{std::numeric_limits<S>::max(), std::numeric_limits<S>::max(),
              std::numeric_limits<S>::max()};
  /// Largest coordinates.
  Vec3<S> high{std::numeric_limits<S>::lowest(), std::numeric_limits<S>::lowest(),
               std::numeric_limits<S>::lowest()};

  /// True if nothing was added.
  GSNAV_HD bool empty() const noexcept { return low.x > high.x; }
  /// Extends the box to contain p.
  GSNAV_HD void add(const Vec3<S>& p) noexcept {
    low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
    high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
  }
  /// Extends the box to contain b.
  GSNAV_HD void add(const Aabb& b) noexcept {
    if (!b.empty()) {
      add(b.low);
      add(b.high);
    }
  }
};

/// Squared distance between two boxes; 0 where they touch or overlap.
inline double distance2(const Aabb<double>& a, const Aabb<double>& b) noexcept {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = max(max(a.low[k] - b.high[k], b.low[k] - a.high[k]), 0.0);
    sum += gap * gap;
  }
  return sum;
}

}  // namespace gsnav
