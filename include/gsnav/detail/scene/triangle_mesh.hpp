// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav {

/// An indexed triangle mesh: metres, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3f> vertices;                          ///< Corners, metres.
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into `vertices`
};

}  // namespace gsnav
