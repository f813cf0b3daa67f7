// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/scene/gaussian_cloud.hpp"
#include "ply_header.hpp"

namespace gsnav::io::detail {

/// Whether a PLY is a cloud of coloured points: x y z, red green blue and nothing of a Gaussian's shape.
bool is_point_cloud(const PlyElement& vertex);

/// What a colour's value 1 is in a property of that type: bytes are fractions of 255, floats are in [0,
/// 1].
double greatest_colour(PlyType type) noexcept;

/// Reads a cloud of coloured points as round Gaussians, the way training begins with them: standard
/// deviations are the root mean square distances to the three nearest points (at most four times the
/// cloud's median), opacity 0.99, colours as stored. `bytes` is the whole file. Errors as parse_ply.
Result<LoadedCloud> parse_ply_points(std::span<const std::byte> bytes, const PlyHeader& header,
                                     const std::string& source);

}  // namespace gsnav::io::detail
