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
  std::size_t gaussians = 100000;  ///< Approximate number of Gaussians, in [100, 4000000].
  std::uint64_t seed = 1;          ///< Seed; equal seeds give equal results.
  double overlap = 0.7;     ///< Standard deviation along the surface, in units of the least spacing, >
                            ///< 0.
  double thickness = 0.12;  ///< Standard deviation across the surface, in units of the spacing, > 0.
  double opacity = 0.99;    ///< In (0, 1).
  double shade = 0.0;  ///< Share of light lost by surfaces that look down in the bind pose, in [0, 1].
  WeightOptions weights{};  ///< Choose its poses from the motions that the avatar will make.
};

/// An avatar made from a rigged mesh.
struct MeshAvatar {
  AvatarAsset asset;     ///< The avatar.
  double area = 0.0;     ///< Area of the surface in its bind pose, square metres.
  double spacing = 0.0;  ///< Least distance between two Gaussians on one side of the surface, metres.
  WeightReport weights;  ///< What happened to the skinning weights.
};

namespace detail {

/// A point of a mesh.
struct MeshSample {
  std::size_t triangle = 0;
  Vec3d at{}, position{}, normal{};  // barycentric coordinates; metres; unit, outwards
};

}  // namespace detail

/// Makes an avatar of Gaussians from a rigged surface. Points are spread evenly over it by dart
/// throwing: two points that face the same way are at least `spacing` apart. Each becomes a Gaussian
/// that is flattened along its triangle, with the surface's colour there (SH degree 0, display-referred)
/// and the weights of the triangle's corners. In the bind pose, Gaussians lie on the triangles. In
/// another pose each moves by its own blended weights, so that it is near its posed triangle, but not
/// exactly on it. The same input gives the same Gaussians. Errors: those of the mesh; invalid_argument
/// naming the option; unsupported (a body that reaches further than 32 m from its root).
Result<MeshAvatar> make_mesh_avatar(const SkinnedMesh& mesh, const MeshAvatarOptions& options = {});

}  // namespace gsnav
