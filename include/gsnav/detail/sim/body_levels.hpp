// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

/// A body that is posed at several levels of detail.
struct BodyLevels {
  const AvatarAsset* asset = nullptr;  ///< Null: no camera sees the body, or it has no levels.
  ChunkBounds bounds{};                ///< A box that contains it, in its frame.
  Similarity world_from_body{};        ///< Its placement.
  std::vector<GaussianSet> sets;       ///< The posed levels, filtered for the photo's pixels.
  std::vector<std::size_t> levels;     ///< The level of each of `sets`; 0 is the whole body.

  /// The set that a camera draws. Empty if the camera does not see the body.
  GaussianSet set_for(const Camera& camera, const LodChoice& choice) const;
};

/// The level of a body that a camera draws: the coarsest whose error LodChoice allows, by the rule for
/// nodes of a tree. 0 is the whole body.
/// @param bounds a box that contains the body, in its frame.
inline std::size_t level_of_body(const AvatarAsset& asset, const Similarity& world_from_body,
                                 const ChunkBounds& bounds, const Camera& camera,
                                 const LodChoice& choice) {
  GaussianSet placed{};
  placed.world_from_asset = world_from_body;
  const auto p = make_projection_camera<double>(camera, placed);
  const double nearest = detail::SeenByCamera{p}.nearest(bounds);
  const double scale = lod_units_per_metre(p, choice) / nearest;
  std::size_t level = asset.levels.size();
  while (level > 0 && relative_lod_error(asset.levels[level - 1].error, asset.levels[level - 1].grain,
                                         scale, choice) > 1) {
    --level;
  }
  return level;
}

inline GaussianSet BodyLevels::set_for(const Camera& camera, const LodChoice& choice) const {
  const std::size_t wanted = level_of_body(*asset, world_from_body, bounds, camera, choice);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (levels[i] == wanted) return sets[i];
  }
  GaussianSet nothing = sets[0];
  nothing.gaussians = {};
  return nothing;
}

}  // namespace gsnav
