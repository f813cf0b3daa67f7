// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/frame/gaussians.hpp"

namespace gsnav {

/// Computes a box that contains all Gaussians of a body in any pose. A skinned point is a mean of the
/// positions that its joints alone would give it, and each of these is as far from its joint as in the
/// bind pose. It therefore lies in the box around balls at the joints, whose radius is the distance of
/// the furthest Gaussian that the joint moves. The box contains the levels of detail of the body too, if
/// they are wanted.
class BodyBounds {
 public:
  /// Measures the reach of each joint in the asset.
  explicit BodyBounds(const AvatarAsset& asset, bool with_levels = false);

  /// The box for a pose. `joints` [J]: joint to root frame, metres.
  ChunkBounds at(const std::vector<Affine3<double>>& joints) const noexcept;
  /// A box for all poses whose joints are in a ball (root frame, metres).
  ChunkBounds around(const Vec3d& center, double radius) const noexcept;

 private:
  ChunkBounds grown(ChunkBounds box) const noexcept;
  void add(const AvatarAsset& asset, const std::vector<Affine3<double>>& bind_inverses);

  std::vector<double> reach_;  // [J] metres; negative: the joint moves nothing
  double bulge_ = 0;           // with dual quaternions: how far a point may lie outside, as a share of
                               // the box's diagonal
  float scale_ = 0, opacity_ = 0;
};

}  // namespace gsnav
