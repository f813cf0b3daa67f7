// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

/// A body that is posed at several levels of detail.
struct BodyDetail {
  const AvatarAsset* asset = nullptr;  ///< Null: no camera sees the body, or it has no levels.
  ChunkBounds bounds{};                ///< A box that contains it, in its frame.
  std::vector<GaussianSet> sets;       ///< By level, that of the whole body first, as the photo's pixels
                                       ///< see them. Empty where a level was not posed.
};

/// The level of a body that a camera draws: the coarsest whose error LodChoice allows, by the rule for
/// nodes of a tree. 0 is the whole body.
/// @param body a set with the body's placement and filter.
/// @param bounds a box that contains the body, in its frame.
inline std::size_t level_of_body(const AvatarAsset& asset, const GaussianSet& body,
                                 const ChunkBounds& bounds, const Camera& camera,
                                 const LodChoice& choice) {
  const auto p = make_projection_camera<double>(camera, body);
  const double nearest = detail::SeenByCamera{p}.nearest(bounds);
  const double scale = max(p.fx, p.fy) / choice.pixels / nearest;
  std::size_t level = asset.levels.size();
  while (level > 0 && relative_lod_error(asset.levels[level - 1].error, asset.levels[level - 1].grain,
                                         scale, choice) > 1) {
    --level;
  }
  return level;
}

}  // namespace gsnav
