// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/math/capsule.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// How a body and its capsules fill space, cubic metres.
struct CapsuleVolume {
  double body = 0.0;       ///< enclosed by the body's surface
  double uncovered = 0.0;  ///< of it, in no capsule
  double over = 0.0;       ///< of the capsules, outside of the body
};

/// Counts cells: those that hold points of the surface, by half, covered by the share of the points that
/// are, and those that cannot be reached from outside without passing one of these. `surface`: points
/// all over the body's surface (centres of its Gaussians), metres. Cells are a centimetre, more where
/// points are sparse, so that the surface has no holes; the error is about half a cell times the part of
/// the surface that curves, 2 % of a person.
CapsuleVolume measure_capsule_volume(const std::vector<Vec3d>& surface,
                                     const std::vector<Capsule<double>>& capsules);

}  // namespace gsnav
