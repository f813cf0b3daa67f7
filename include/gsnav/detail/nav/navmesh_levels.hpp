// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// A storey: surface of about one height.
struct NavLevel {
  double height = 0.0;  ///< mean over its area, world, metres
  double area = 0.0;    ///< square metres that `height` is the mean of
};

/// What counts as a storey.
struct LevelOptions {
  double band = 0.15;    ///< half the range of heights that make a level, metres
  double min_gap = 1.5;  ///< levels are at least this far apart: a dais or a stair's landing is no level
  double min_area = 2.0;  ///< square metres that make a level
};

/// Storeys of a NavMesh, from the lowest up: the heights with the most surface first, then those that
/// are left `min_gap` away. Surface sloped by more than 10 degrees (stairs, ramps) counts for none.
std::vector<NavLevel> find_levels(const NavMesh& mesh, const LevelOptions& options = {});

/// The level that someone at height `y` is on: the highest that lies at most `tolerance` above it. The
/// lowest where all are higher; none without levels or where y is NaN.
std::optional<std::size_t> level_at(std::span<const NavLevel> levels, double y,
                                    double tolerance = 0.25) noexcept;

}  // namespace gsnav
