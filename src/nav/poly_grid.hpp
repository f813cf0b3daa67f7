// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gsnav/math/aabb.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav::detail {

struct PolyMesh;

/// Grid that finds the polygon nearest to a point: square cells on the ground plane, each with the
/// polygons whose boxes overlap it. Thread-safe after build().
class PolyGrid {
 public:
  void build(const PolyMesh& mesh);

  /// Nearest point of the surface within a box around q.
  /// For each polygon, the candidate is its point nearest to q on the ground plane. A candidate directly
  /// above or below q by at most `climb` counts as distance 0. Ties go to the candidate nearest in
  /// height, then to the smallest polygon id.
  /// @param half Half extents of the box, metres.
  /// @param island Consider this island only.
  NavPoint nearest(const PolyMesh& mesh, const Vec3d& q, const Vec3d& half, double climb,
                   std::optional<std::size_t> island = {}) const noexcept;

 private:
  Vec3d low_{};
  double side_ = 1.0;
  std::int64_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> first_;  ///< Begin of each cell in `polys_`, and one past the last.
  std::vector<PolyId> polys_;
  std::vector<Aabb<double>> boxes_;  ///< One per polygon, height triangles included.
};

}  // namespace gsnav::detail
