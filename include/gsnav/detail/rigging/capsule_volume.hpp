// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Volumes of a body and its capsules, cubic metres.
struct CapsuleVolume {
  double body = 0.0;       ///< Inside the body's surface.
  double uncovered = 0.0;  ///< Part of the body outside of all capsules.
  double over = 0.0;       ///< Part of the capsules outside of the body.
};

/// Measures volumes by cubic cells. `surface`: points all over the body's surface (centres of its
/// Gaussians), metres. A cell with surface points counts half, and is covered by the share of its points
/// that lie in capsules. A cell that cannot be reached from outside without crossing such cells is
/// inside. Cells are 1 cm wide, or wider where points are sparse, so that the surface has no holes. The
/// error is about half a cell times the area of curved surface: 2 % for a person.
CapsuleVolume measure_capsule_volume(const std::vector<Vec3d>& surface,
                                     const std::vector<Capsule<double>>& capsules);

}  // namespace gsnav
