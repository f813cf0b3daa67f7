// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "gsnav/scene/gaussian_cloud.hpp"
#include "ply_header.hpp"

namespace gsnav::io::detail {

/// Whether a PLY is a cloud of coloured points: x y z and red green blue, without any property of a
/// Gaussian's shape.
bool is_point_cloud(const PlyElement& vertex);

/// The value that stands for a full colour in a property of this type: 255 for bytes, 1 for floats.
double greatest_colour(PlyType type) noexcept;

/// Reads a cloud of coloured points as round Gaussians, as training begins with them. The standard
/// deviation is the root mean square distance to the three nearest points (at most four times the
/// cloud's median), opacity 0.99, colours as stored. `bytes` is the whole file. Errors: those of
/// parse_ply.
Result<LoadedCloud> parse_ply_points(std::span<const std::byte> bytes, const PlyHeader& header,
                                     const std::string& source);

}  // namespace gsnav::io::detail
