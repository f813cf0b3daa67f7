// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav {

/// Squared distance of p from the segment a b.
inline double segment_distance2(const Vec3d& a, const Vec3d& b, const Vec3d& p) noexcept {
  const Vec3d ab = b - a;
  const double length2 = dot(ab, ab);
  const double t = length2 > 0 ? clamp(dot(p - a, ab) / length2, 0.0, 1.0) : 0.0;
  const Vec3d d = p - (a + ab * t);
  return dot(d, d);
}

/// Canonical Gaussian centres after skinning by joint matrices (double, root frame, metres).
std::vector<Vec3d> skinned_centers(const AvatarAsset& asset, const std::vector<Affine3<double>>& joints);

/// Fits `capsules` of the asset to its Gaussians over poses (joint to root frame each, [J]): every
/// centre goes to the capsule whose axis is nearest in the bind pose among those of its joints, then
/// ends are drawn in or out along the axis and the radius is the `percentile` of the distances in all
/// poses. Capsules that get no Gaussian are dropped.
void fit_capsules(AvatarAsset& asset, const std::vector<std::vector<Affine3<double>>>& poses,
                  double percentile = 0.99);

}  // namespace gsnav
