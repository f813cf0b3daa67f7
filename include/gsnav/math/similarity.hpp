// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Similarity x_world = scale * rotation * x_asset + translation: how an asset stands in the Y-up world.
/// Metres and double throughout, so that a scene a thousand kilometres away loses nothing.
struct Similarity {
  Quatd rotation{};     ///< Rotation, a unit quaternion.
  Vec3d translation{};  ///< Added last, metres.
  double scale = 1.0;   ///< Factor on lengths, > 0.
};

/// Image of a point.
inline Vec3d operator*(const Similarity& s, const Vec3d& v) noexcept {
  return rotate(s.rotation, v) * s.scale + s.translation;
}

/// The similarity that applies b, then a.
inline Similarity operator*(const Similarity& a, const Similarity& b) noexcept {
  Quatd q = a.rotation * b.rotation;
  normalize(q);
  return {q, a * b.translation, a.scale * b.scale};
}

/// The inverse.
inline Similarity inverse(const Similarity& s) noexcept {
  const Quatd q = conjugate(s.rotation);
  return {q, rotate(q, s.translation) * (-1.0 / s.scale), 1.0 / s.scale};
}

}  // namespace gsnav
