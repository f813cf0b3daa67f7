// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav::detail {

/// Position on a walk at a fraction. After the last point it is that point. Zero if there are no points.
inline Vec3d position_at(std::span<const WalkPoint> path, double fraction) noexcept {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const WalkPoint &from = path[i - 1], &to = path[i];
    if (!(fraction < to.fraction)) continue;
    const double whole = to.fraction - from.fraction;
    const double share = whole > 0 ? (fraction - from.fraction) / whole : 1.0;
    return lerp(from.position, to.position, clamp(share, 0.0, 1.0));
  }
  return path.empty() ? Vec3d{} : path.back().position;
}

}  // namespace gsnav::detail
