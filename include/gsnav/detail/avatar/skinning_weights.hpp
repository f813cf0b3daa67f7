// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/skin/lbs.hpp"

namespace gsnav {

/// A weight from its parts (AvatarAsset::skinning_weights).
inline double weight_of_parts(std::uint16_t parts) noexcept { return skinning_weight<double>(parts); }

/// Weights as parts of kWeightParts that add up to it. `weights` [k]: not negative, greatest first, any
/// sum above zero; divided by it. `parts` [k]: greatest first too.
///
/// Each weight is rounded down and those that lost most get one part more, so that none is off by a
/// part. The positive errors and the negative ones then make k / 4 parts each at most, which bounds how
/// far a point skinned with `parts` is from one skinned with `weights`: k / (4 * kWeightParts) of the
/// greatest distance between two of the places where the joints alone would put it.
void round_weights(const double* weights, std::size_t k, std::uint16_t* parts);

}  // namespace gsnav
