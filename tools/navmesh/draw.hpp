// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_navmesh {

struct MapPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< [height][width][3]
};

/// A map in colours: islands by number, their borders dark, a scale bar of `bar` metres at the lower
/// left. North is -z, east x.
MapPicture draw(const gsnav::TopDownMap& map, double bar);

/// A round length for the bar of a map this wide: 1, 2 or 5 times a power of ten, at most a quarter of
/// it.
double bar_length(double width);

}  // namespace gsnav_navmesh
