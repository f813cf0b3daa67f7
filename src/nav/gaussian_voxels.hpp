// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"

namespace gsnav::detail {

/// Consecutive solid voxels of one column: levels [low, end).
struct SolidRun {
  std::uint16_t low = 0, end = 0;
  bool thin = false;  ///< the top voxel is solid only as one of two that a sheet lies between
  std::size_t top() const noexcept { return end - std::size_t{1}; }
};

/// Solid voxels of a scene as runs: memory grows with the surfaces, not with the box. Column: x + nx *
/// z.
struct VoxelGrid {
  Vec3d low{};  ///< world corner
  double cell = 0.05, level = 0.05;
  std::size_t nx = 0, ny = 0, nz = 0;  ///< columns along x, levels, columns along z
  std::vector<std::uint32_t> first;    ///< [nx * nz + 1], index into `runs`
  std::vector<SolidRun> runs;          ///< of each column upwards, with a gap between two

  std::span<const SolidRun> runs_of(std::size_t column) const noexcept {
    return {runs.data() + first[column], first[column + 1] - first[column]};
  }
};

/// Box of the scene, then the voxels in it; fills the counts of the report. The grid is rasterised in
/// tiles of columns, each by one thread with the Gaussians in their order: the same bits on any number
/// of threads.
Result<VoxelGrid> voxelise(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                           const GaussianNavOptions& options, ThreadPool& pool,
                           GaussianNavReport& report);

}  // namespace gsnav::detail
