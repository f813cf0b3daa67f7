// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav {

/// Centres of the Gaussians after skinning, in the root frame, metres. `globals` [J] takes joints to the
/// root frame.
std::vector<Vec3d> skinned_centers(const AvatarAsset& asset, std::vector<Affine3<double>> globals);

/// Fits the asset's `capsules` to its Gaussians over poses ([J] joint to root frame each). Each centre
/// goes to the capsule of one of its joints whose axis is nearest in the bind pose. The ends then move
/// along the axis to fit, and the radius becomes the `percentile` of the distances in all poses.
/// Capsules without Gaussians are dropped.
void fit_capsules(AvatarAsset& asset, const std::vector<std::vector<Affine3<double>>>& poses,
                  double percentile = 0.99);

}  // namespace gsnav
