// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/skinned_mesh.hpp"
#include "gsnav/detail/avatar/weight_truncation.hpp"
#include "gsnav/detail/rigging/mesh_avatar.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

namespace detail {

/// Finds the triangle nearest to a point among those of the vertices near it.
class NearestTriangle {
 public:
  explicit NearestTriangle(const SkinnedMesh& mesh);

  MeshSample find(const Vec3d& p, double& distance) const;

 private:
  static constexpr std::int64_t kRings = 12;

  void look(std::uint32_t t, const Vec3d& p, MeshSample& best, double& distance) const;
  std::array<std::int64_t, 3> cell_of(const Vec3d& p) const;
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) noexcept;
  const SkinnedMesh& mesh_;
  std::vector<std::vector<std::uint32_t>> around_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  double cell_ = 1.0;
};

}  // namespace detail

/// How a cloud is bound to a skeleton.
struct CloudBindingOptions {
  Similarity mesh_from_cloud{};  ///< takes the cloud's frame to the mesh's: HumanGaussian's are scaled
                                 ///< and shifted
  double furthest = 0.05;        ///< metres; Gaussians further from the surface are left out
  WeightOptions weights;         ///< How many influences are kept.
};

/// A cloud as an avatar, and how well it is bound.
struct BoundCloud {
  AvatarAsset asset;         ///< The avatar.
  std::size_t left_out = 0;  ///< Gaussians further from the surface than allowed
  double furthest = 0.0;     ///< metres, of those kept
  WeightReport weights;      ///< What happened to the skinning weights.
};

/// An avatar from Gaussians that were made around a body without weights (HumanGaussian's PLY, a scan):
/// each takes those of the nearest point of the rigged surface, which stands in the pose the Gaussians
/// are in. SH above degree 0 is kept only where the frames are not turned against each other. Errors:
/// what the mesh reports; invalid_argument (the options; nothing is near the surface); unsupported (SH
/// of a higher degree in a turned frame; a body further than 32 m from its root).
Result<BoundCloud> bind_cloud(const GaussianCloud& cloud, const SkinnedMesh& mesh,
                              const CloudBindingOptions& options = {});

}  // namespace gsnav
