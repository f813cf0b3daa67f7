// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/nav/gaussian_navmesh.hpp"

namespace gsnav::detail {

/// Solid voxels of a scene. Index: (column x + nx * row z) * ny + level, levels upwards.
struct VoxelGrid {
  Vec3d low{};  ///< world corner
  double cell = 0.05, level = 0.05;
  std::size_t nx = 0, ny = 0, nz = 0;
  std::vector<std::uint8_t> solid;

  std::size_t at(std::size_t x, std::size_t y, std::size_t z) const noexcept {
    return (x + nx * z) * ny + y;
  }
};

/// Box of the scene, then the voxels in it; fills the counts of the report.
Result<VoxelGrid> voxelise(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                           const GaussianNavOptions& options, GaussianNavReport& report);

}  // namespace gsnav::detail
