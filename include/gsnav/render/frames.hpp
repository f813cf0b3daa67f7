// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gsnav {

/// What the meshes of a frame were made of.
struct MeshStats {
  std::uint64_t triangles = 0;   ///< in all instances
  std::uint64_t not_finite = 0;  ///< of those in view, left out: a corner is NaN or infinite
  std::uint64_t drawn = 0;       ///< that may cover a pixel centre; pieces, where clipped
  std::uint64_t fragments =
      0;  ///< pixels of surfaces that are seen through (MeshAlpha::blend), not behind opaque ones
};

/// What one camera's frame was made of.
struct RenderStats {
  std::uint64_t gaussians = 0;  ///< in all sets
  std::uint64_t visible = 0;    ///< whose footprint bounds reach the image, less those found hidden
  std::uint64_t tile_intersections = 0;  ///< (tile, Gaussian) pairs, less those found hidden by a mesh
  MeshStats meshes;                      ///< Counts of the triangles.
};

/// Images of a batch of cameras of one size in host memory; an image not asked for is empty.
template <class S>
struct Frames {
  std::size_t cameras = 0, height = 0, width = 0;  ///< Number of cameras and size of each image.
  std::vector<S> rgb;                              ///< [C][H][W][3]
  std::vector<S> alpha;                            ///< [C][H][W]
  std::vector<S> median_depth;                     ///< [C][H][W] metres, 0: no return
  std::vector<S> expected_depth;                   ///< [C][H][W]
  std::vector<S> accumulated_depth;                ///< [C][H][W]
  std::vector<S> first_hit_depth;                  ///< [C][H][W]
  std::vector<RenderStats> stats;                  ///< [C]

  /// The images in the order of kImages (detail/frame/output.hpp).
  using VectorPointer = std::vector<S> Frames::*;
  /// All images.
  static constexpr VectorPointer kVectors[] = {&Frames::rgb,
                                               &Frames::alpha,
                                               &Frames::median_depth,
                                               &Frames::expected_depth,
                                               &Frames::accumulated_depth,
                                               &Frames::first_hit_depth};
};

}  // namespace gsnav
