// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gsnav {

/// Counts of the triangles in a frame.
struct MeshStats {
  std::uint64_t triangles = 0;   ///< triangles of all instances
  std::uint64_t not_finite = 0;  ///< Triangles in view that are left out because a corner is NaN or
                                 ///< infinite.
  std::uint64_t drawn = 0;  ///< Triangles that may cover a pixel centre. A clipped triangle counts once
                            ///< per piece.
  std::uint64_t fragments =
      0;  ///< Pixels of see-through surfaces (MeshAlpha::blend) that are not behind opaque ones.
};

/// Counts of one camera's frame. A GPU does not count `visible`, and pairs and triangles only for one
/// camera at a time. They are 0 then.
struct RenderStats {
  std::uint64_t gaussians = 0;  ///< Gaussians in all sets
  std::uint64_t visible = 0;  ///< Gaussians whose footprint bounds reach the image, without those found
                              ///< hidden
  std::uint64_t tile_intersections = 0;  ///< (tile, Gaussian) pairs, without those found hidden by a
                                         ///< mesh
  MeshStats meshes;                      ///< triangles of the meshes
};

/// Images of a batch of C cameras of one size (H x W pixels), in host memory. Images that were not
/// requested are empty. Output (frame/rules.hpp) defines the values.
template <class S>
struct Frames {
  std::size_t cameras = 0,           ///< number of cameras, C
      height = 0,                    ///< rows of an image, H
      width = 0;                     ///< columns of an image, W
  std::vector<S> rgb;                ///< [C][H][W][3], colours over the background
  std::vector<S> alpha;              ///< [C][H][W]
  std::vector<S> median_depth;       ///< [C][H][W] metres; 0 where the ray hits nothing
  std::vector<S> expected_depth;     ///< [C][H][W] metres
  std::vector<S> accumulated_depth;  ///< [C][H][W] metres
  std::vector<S> first_hit_depth;    ///< [C][H][W] metres
  std::vector<RenderStats> stats;    ///< [C]

  /// Pointer to the vector of one image.
  using VectorPointer = std::vector<S> Frames::*;
  /// The images in the order of kImages (detail/frame/output.hpp).
  static constexpr VectorPointer kVectors[] = {&Frames::rgb,
                                               &Frames::alpha,
                                               &Frames::median_depth,
                                               &Frames::expected_depth,
                                               &Frames::accumulated_depth,
                                               &Frames::first_hit_depth};
};

}  // namespace gsnav
