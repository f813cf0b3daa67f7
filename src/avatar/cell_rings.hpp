// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace gsnav::detail {

/// Indices of a cell in a grid of cubic cells.
using GridCell = std::array<std::int64_t, 3>;

/// Calls f(cell) for the cells whose Chebyshev distance from `center` is `ring`: the surface of a cube.
template <class F>
void for_each_cell_in_ring(const GridCell& center, std::int64_t ring, const F& f) {
  for (std::int64_t z = -ring; z <= ring; ++z) {
    for (std::int64_t y = -ring; y <= ring; ++y) {
      const bool face = std::abs(z) == ring || std::abs(y) == ring;
      for (std::int64_t x = -ring; x <= ring; x += face ? 1 : 2 * ring)
        f(GridCell{center[0] + x, center[1] + y, center[2] + z});
    }
  }
}

}  // namespace gsnav::detail
