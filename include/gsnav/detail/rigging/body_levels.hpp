// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/asset.hpp"

namespace gsnav {

/// Levels of detail of a body, for AvatarAsset::levels. Each has half the Gaussians of the one before,
/// down to about 100. Gaussians are merged like those of build_lod, within the part of the body that
/// one joint moves most. The weights of a merged Gaussian are the mean of those that it stands for.
/// Takes about 15 s for each million Gaussians. The same body gives the same bits.
/// @return the levels, which are none for a body of few Gaussians; the errors of AvatarAsset::validate;
/// unsupported for Skinning::linear_stretched.
Result<std::vector<AvatarLevel>> body_levels(const AvatarAsset& body);

}  // namespace gsnav
