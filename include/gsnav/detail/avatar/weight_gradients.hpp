// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Settings of the estimate of weight gradients.
struct WeightGradientOptions {
  std::size_t neighbours = 16;  ///< Gaussians to whose weights a gradient is fitted, >= 4
};

/// Gives the asset linear_stretched skinning: AvatarAsset::weight_gradients by a linear fit to the
/// weights of each Gaussian's nearest neighbours. Weights are known on the surface only, so a gradient
/// has no part in directions in which the neighbours hardly spread; neighbours that share less than 0.3
/// of their weights lie on another part of the body (a hand at the hip) and do not count. Errors:
/// invalid_argument (the asset's, the options).
Status bake_weight_gradients(AvatarAsset& asset, const WeightGradientOptions& options = {});

}  // namespace gsnav
