// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/skinned_mesh.hpp"
#include "gsnav/detail/avatar/weight_truncation.hpp"

namespace gsnav {

/// How Gaussians are spread over a surface.
struct MeshAvatarOptions {
  std::size_t gaussians = 100000;  ///< about so many, [100, 4000000]
  std::uint64_t seed = 1;          ///< Seed; equal seeds give equal results.
  double overlap = 0.7;            ///< standard deviation along the surface over the least spacing, > 0
  double thickness = 0.12;         ///< standard deviation across the surface over the spacing, > 0
  double opacity = 0.99;           ///< (0, 1)
  double shade =
      0.0;  ///< share of the light that surfaces lose which look down in the bind pose, [0, 1]
  WeightOptions weights{};  ///< its poses should be those of the motions it will make
};

/// An avatar made from a rigged mesh.
struct MeshAvatar {
  AvatarAsset asset;     ///< The avatar.
  double area = 0.0;     ///< of the surface in its bind pose, square metres
  double spacing = 0.0;  ///< metres; no two Gaussians of one side are nearer than this
  WeightReport weights;  ///< What happened to the skinning weights.
};

namespace detail {

/// A point of a mesh.
struct MeshSample {
  std::size_t triangle = 0;
  Vec3d at{}, position{}, normal{};  // barycentric; metres; unit, outwards
};

}  // namespace detail

/// An avatar of Gaussians from a rigged surface: points spread evenly over it (dart throwing: none
/// nearer than `spacing` to another that looks the same way), each a Gaussian flattened along its
/// triangle, of the surface's colour there (SH degree 0, display-referred) and with the weights of its
/// triangle's corners. Gaussians lie on the surface where it is flat between vertices, in the bind pose
/// and, to within the weights kept, in every other: a point's skinned place is not its triangle's, but
/// what its own blended weights make of it. The same input gives the same Gaussians. Errors: what the
/// mesh reports; invalid_argument naming the option; unsupported (a body further than 32 m from its
/// root).
Result<MeshAvatar> make_mesh_avatar(const SkinnedMesh& mesh, const MeshAvatarOptions& options = {});

}  // namespace gsnav
