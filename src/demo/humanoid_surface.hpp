// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "body_shape.hpp"
#include "gsnav/detail/demo/humanoid.hpp"

namespace gsnav::detail {

/// Fills the cloud and weights of `asset` from the surface of `shape`. Errors: those of
/// AvatarAsset::set_weights.
Status cover_with_gaussians(const HumanoidOptions& o, const BodyShape& shape, AvatarAsset& asset);

}  // namespace gsnav::detail
