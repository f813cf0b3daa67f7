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

/// Finds the triangle nearest to a point, among the triangles at the vertices near it.
class NearestTriangle {
 public:
  /// Keeps a reference to the mesh.
  explicit NearestTriangle(const SkinnedMesh& mesh);

  /// The nearest point of the mesh. `distance` gets its distance from p, metres.
  MeshSample find(const Vec3d& p, double& distance) const;

 private:
  static constexpr std::int64_t kRings = 12;

  void look(std::uint32_t t, const Vec3d& p, MeshSample& best, double& distance) const;
  std::array<std::int64_t, 3> cell_of(const Vec3d& p) const;
  static std::uint64_t key(const std::array<std::int64_t, 3>& cell) noexcept;
  const SkinnedMesh& mesh_;
  std::vector<std::vector<std::uint32_t>> around_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  double cell_ = 1.0;
};

}  // namespace detail

/// Settings of bind_cloud.
struct CloudBindingOptions {
  Similarity mesh_from_cloud{};  ///< Transform from the frame of the cloud to that of the mesh.
                                 ///< HumanGaussian's clouds are scaled and shifted.
  double furthest = 0.05;        ///< Metres. Gaussians further from the surface are left out.
  WeightOptions weights;         ///< How many weights are kept.
};

/// An avatar that bind_cloud made.
struct BoundCloud {
  AvatarAsset asset;         ///< The avatar.
  std::size_t left_out = 0;  ///< Gaussians further from the surface than allowed.
  double furthest = 0.0;     ///< Greatest distance from the surface of those kept, metres.
  WeightReport weights;      ///< The error of the weights that were dropped.
};

/// Makes an avatar from Gaussians without weights, such as HumanGaussian's PLY or a scan of a person.
/// Each Gaussian takes the weights of the nearest point of the rigged surface, whose pose must be that
/// of the Gaussians. SH above degree 0 is kept only if `mesh_from_cloud` does not rotate. Errors: those
/// of the mesh; invalid_argument (an option out of range; no Gaussian near the surface); unsupported (SH
/// of a higher degree with a rotation; a body that reaches further than 32 m from its root).
Result<BoundCloud> bind_cloud(const GaussianCloud& cloud, const SkinnedMesh& mesh,
                              const CloudBindingOptions& options = {});

}  // namespace gsnav
