// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "body_shape.hpp"
#include "gsnav/detail/demo/humanoid.hpp"

namespace gsnav::detail {

/// Fills cloud and weights of `asset` with the surface of `shape`. Errors: as of
/// AvatarAsset::set_weights.
Status cover_with_gaussians(const HumanoidOptions& o, const BodyShape& shape, AvatarAsset& asset);

}  // namespace gsnav::detail
