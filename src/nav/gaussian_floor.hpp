// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gaussian_voxels.hpp"

// The floors among the solid voxels of a scene: the storey that most stands on, further storeys, and the
// stairs and ramps between them.

namespace gsnav::detail {

/// Levels whose tops are walkable, column by column, upwards.
struct FloorTops {
  std::vector<std::uint32_t> first;  ///< [nx * nz + 1]
  std::vector<std::uint16_t> tops;
};

/// What the floors are looked for with, in voxels.
struct FloorSettings {
  std::size_t clearance = 0;  ///< levels free above a floor
  std::size_t climb = 0;      ///< levels of the highest step
  std::size_t band = 0;       ///< levels that a floor may leave its own height by
  double max_slope = 1.0;     ///< tangent of the steepest ground
};

/// Finds the floors, and levels the voxels that noise leaves on stairs; fills the report's heights and
/// areas. No top where the scene has none (`most_area` then names the largest area at any height).
FloorTops find_floors(VoxelGrid& g, const FloorSettings& settings, const GaussianNavOptions& options,
                      ThreadPool& pool, GaussianNavReport& report, double& most_area);

}  // namespace gsnav::detail
