// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Similarity x_world = scale * rotation * x_asset + translation: the placement of an asset in the Y-up
/// world. Metres, in double, so that a scene 1000 km from the origin loses no precision.
struct Similarity {
  Quatd rotation{};     ///< unit quaternion
  Vec3d translation{};  ///< metres
  double scale = 1.0;   ///< > 0
};

/// Returns true if `s` is finite, with a unit quaternion and a positive scale.
inline bool is_valid(const Similarity& s) noexcept {
  return s.scale > 0 && is_finite(s.scale) && is_finite(s.translation) &&
         abs(dot(s.rotation, s.rotation) - 1.0) < 1e-6;
}

/// Maps the point v.
inline Vec3d operator*(const Similarity& s, const Vec3d& v) noexcept {
  return rotate(s.rotation, v) * s.scale + s.translation;
}

/// Composition: b first, then a.
inline Similarity operator*(const Similarity& a, const Similarity& b) noexcept {
  Quatd q = a.rotation * b.rotation;
  normalize(q);
  return {q, a * b.translation, a.scale * b.scale};
}

/// Inverse map.
inline Similarity inverse(const Similarity& s) noexcept {
  const Quatd q = conjugate(s.rotation);
  return {q, rotate(q, s.translation) * (-1.0 / s.scale), 1.0 / s.scale};
}

}  // namespace gsnav
