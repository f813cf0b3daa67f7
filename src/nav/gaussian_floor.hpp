// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gaussian_voxels.hpp"

// Floors among the solid voxels of a scene: the main storey, further storeys, and the stairs and ramps
// between them.

namespace gsnav::detail {

/// Walkable levels per column, from the lowest up.
struct FloorTops {
  std::vector<std::uint32_t> first;  ///< Shape [nx * nz + 1], index into `tops`.
  std::vector<std::uint16_t> tops;
};

/// Settings of the search for floors, in voxels.
struct FloorSettings {
  std::size_t clearance = 0;  ///< Free levels that are needed above a floor.
  std::size_t climb = 0;      ///< Levels of the highest step.
  std::size_t band = 0;       ///< Levels that a floor may differ from the height of its storey.
  double max_slope = 1.0;     ///< Tangent of the steepest ground.
};

/// Finds the floors, flattens voxels that noise leaves on stairs, and fills in heights and areas of the
/// report. The result is empty if there is no floor; `most_area` then is the largest area at any height,
/// m².
FloorTops find_floors(VoxelGrid& g, const FloorSettings& settings, const GaussianNavOptions& options,
                      ThreadPool& pool, GaussianNavReport& report, double& most_area);

}  // namespace gsnav::detail
