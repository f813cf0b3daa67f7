// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// A box that holds all Gaussians of a body in any pose. A skinned point is a mean of the places where
/// its joints alone would put it, each as far from its joint as in the bind pose: it lies in the box
/// around balls at the joints, each as large as the furthest Gaussian that its joint moves.
class BodyBounds {
 public:
  explicit BodyBounds(const AvatarAsset& asset);  ///< Measures the avatar once, at each of its joints.

  /// For joints to root frame, [J], metres.
  ChunkBounds at(const std::vector<Affine3<double>>& joints) const noexcept;

 private:
  std::vector<double> reach_;  // [J] metres; negative: moves nothing
  double bulge_ = 0;           // of dual quaternions: how far out of the box, as a share of its diagonal
  float scale_ = 0, opacity_ = 0;
};

}  // namespace gsnav
