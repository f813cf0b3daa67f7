// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gsnav/math/aabb.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav::detail {

struct PolyMesh;

/// Finds the polygon that a point is on: the ground plane in square cells, each with the polygons whose
/// boxes reach into it. Constant after build(), so that any number of threads may ask without a lock.
class PolyGrid {
 public:
  void build(const PolyMesh& mesh);

  /// The nearest point of the surface within the box of half extents around q. Each polygon offers its
  /// point that is nearest on the ground plane; one straight above or below q by at most `climb` counts
  /// as at q, and of several such the one nearest in height wins, then the least polygon. Only of
  /// `island`, where one is named.
  NavPoint nearest(const PolyMesh& mesh, const Vec3d& q, const Vec3d& half, double climb,
                   std::optional<std::size_t> island = {}) const noexcept;

 private:
  Vec3d low_{};
  double side_ = 1.0;
  std::int64_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< of each cell in `polys_`, and one past the last
  std::vector<PolyId> polys_;
  std::vector<Aabb<double>> boxes_;  ///< of each polygon, height triangles included
};

}  // namespace gsnav::detail
