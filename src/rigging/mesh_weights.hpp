// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "gsnav/detail/rigging/mesh_avatar.hpp"

namespace gsnav::detail {

/// The weights of a point: those of its triangle's corners, weighted by barycentric coordinates. Each
/// joint occurs at most once.
void blend_weights(const SkinnedMesh& mesh, const MeshSample& p,
                   std::vector<std::pair<std::uint16_t, double>>& out);

/// Gives the asset the Gaussians of `builder` and their weights: a row of (joint, weight) for each, of
/// which `options` decides how many are kept.
Status finish_avatar(AvatarAsset& asset, GaussianCloudBuilder& builder,
                     const std::vector<std::vector<std::pair<std::uint16_t, double>>>& rows,
                     const WeightOptions& options, WeightReport& report);

}  // namespace gsnav::detail
