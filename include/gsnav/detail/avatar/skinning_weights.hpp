// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/skin/lbs.hpp"

namespace gsnav {

/// Skinning weight in [0, 1] of an integer number of parts, each of which is 1 / kWeightParts.
inline double weight_of_parts(std::uint16_t parts) noexcept { return skinning_weight<double>(parts); }

/// Rounds weights to integer parts whose sum is kWeightParts.
/// @param weights [k] not negative, greatest first, with any sum above zero, by which they are divided.
/// @param parts [k] output, greatest first.
///
/// Each weight is rounded down, and those that lost most get one part more, so that no weight is off by
/// a whole part. The positive and the negative errors then sum to at most k / 4 parts each. A point
/// skinned with `parts` is therefore at most k / (4 * kWeightParts) of a distance d away from the one
/// skinned with `weights`, where d is the greatest distance between two of the positions that the joints
/// alone would give.
void round_weights(const double* weights, std::size_t k, std::uint16_t* parts);

}  // namespace gsnav
