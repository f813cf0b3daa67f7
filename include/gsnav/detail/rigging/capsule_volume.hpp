// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// How a body and its capsules fill space, cubic metres.
struct CapsuleVolume {
  double body = 0.0;       ///< inside the body's surface
  double uncovered = 0.0;  ///< of that, outside of all capsules
  double over = 0.0;       ///< of the capsules, outside of the body
};

/// Measures volumes in cubic cells. `surface`: points all over the body's surface (centres of its
/// Gaussians), metres. A cell that holds points of the surface counts half, and is covered by the share
/// of its points that lie in capsules. Cells that cannot be reached from outside without passing one of
/// those are inside. Cells are a centimetre, or more where points are sparse, so that the surface has no
/// holes. The error is about half a cell times the area of the surface that curves, 2 % of a person.
CapsuleVolume measure_capsule_volume(const std::vector<Vec3d>& surface,
                                     const std::vector<Capsule<double>>& capsules);

}  // namespace gsnav
