// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Settings of the estimate of weight gradients.
struct WeightGradientOptions {
  std::size_t neighbours = 16;  ///< Number of Gaussians to whose weights a gradient is fitted, >= 4.
};

/// Switches the asset to linear_stretched skinning. AvatarAsset::weight_gradients are a linear fit to
/// the weights of each Gaussian's nearest neighbours. Weights are known on the surface only, so a
/// gradient has no component in directions in which the neighbours hardly spread. Neighbours that share
/// less than 0.3 of their weights are ignored: they lie on another part of the body, like a hand at the
/// hip. Error: invalid_argument (those of the asset, or an option out of range).
Status bake_weight_gradients(AvatarAsset& asset, const WeightGradientOptions& options = {});

}  // namespace gsnav
