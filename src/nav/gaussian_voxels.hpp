// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/detail/core/thread_pool.hpp"
#include "gsnav/detail/nav/gaussian_navmesh.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav::detail {

/// Consecutive solid voxels of one column: levels [low, end).
struct SolidRun {
  std::uint16_t low = 0, end = 0;
  bool thin = false;  ///< True if the top voxel is solid only because a sheet lies between two voxels.
  std::size_t top() const noexcept { return end - std::size_t{1}; }
};

/// Solid voxels of a scene, stored as runs per column (x + nx * z). Memory grows with the surfaces, not
/// with the box.
struct VoxelGrid {
  Vec3d low{};  ///< World position of the corner, metres.
  double cell = 0.05, level = 0.05;
  std::size_t nx = 0, ny = 0, nz = 0;  ///< Number of columns along x, of levels, and of columns along z.
  std::vector<std::uint32_t> first;    ///< Shape [nx * nz + 1], index into `runs`.
  std::vector<SolidRun> runs;          ///< Runs of each column from the lowest up, with gaps between
                                       ///< them.

  std::span<const SolidRun> runs_of(std::size_t column) const noexcept {
    return {runs.data() + first[column], first[column + 1] - first[column]};
  }
  /// Number of columns nearest to a length in metres, at least 1.
  std::size_t cells_in(double length) const noexcept {
    return max<std::size_t>(1, static_cast<std::size_t>(length / cell + 0.5));
  }
};

/// Finds the box of the scene and the voxels in it, and fills in the counts of the report. The grid is
/// rasterized in tiles of columns. One thread processes a tile, with the Gaussians in order, so the
/// result is bit-identical for any number of threads.
Result<VoxelGrid> voxelise(const NavMeshSettings& settings, std::span<const GaussianSet> sets,
                           const GaussianNavOptions& options, ThreadPool& pool,
                           GaussianNavReport& report);

}  // namespace gsnav::detail
