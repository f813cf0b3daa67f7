// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/nav/navmesh.hpp"

namespace gsnav_navmesh {

struct MapPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< Shape [height][width][3].
};

/// Draws a map in colours: islands by number, with dark borders, and a scale bar of `bar` metres at the
/// lower left. Up is -z, right is x.
MapPicture draw(const gsnav::TopDownMap& map, double bar);

/// A round length for the scale bar of a map with this width: 1, 2 or 5 times a power of ten, at most a
/// quarter of the width.
double bar_length(double width);

}  // namespace gsnav_navmesh
