// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// A storey: the surface of a NavMesh at about one height.
struct NavLevel {
  double height = 0.0;  ///< Mean height over its area in the world, metres.
  double area = 0.0;    ///< Area that `height` is averaged over, m².
};

/// Options of find_levels.
struct LevelOptions {
  double band = 0.15;     ///< Half the height range of a storey, metres.
  double min_gap = 1.5;   ///< Smallest height difference of two storeys, metres. It excludes platforms
                          ///< and landings.
  double min_area = 2.0;  ///< Smallest area of a storey, m².
};

/// Finds the storeys of a NavMesh and returns them from the lowest to the highest. Heights with the
/// largest area are chosen first, each at least `min_gap` from those before. Surface steeper than 10
/// degrees (stairs, ramps) is ignored.
std::vector<NavLevel> find_levels(const NavMesh& mesh, const LevelOptions& options = {});

}  // namespace gsnav
