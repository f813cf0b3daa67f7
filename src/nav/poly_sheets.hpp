// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// A face before its sides are split at its neighbours' corners.
struct Sheet {
  static constexpr std::uint32_t kInside = 0xffffffffu;

  PolyId poly = 0;
  std::vector<Vec3d> corners;
  std::vector<std::uint32_t> sides;  ///< the polygon's edge that each edge lies on, or kInside
};

/// A part of a polygon's edge: the edge of a sheet that lies on it, from t0 to t1 of its length.
struct Part {
  std::size_t sheet = 0, edge = 0;
  double t0 = 0, t1 = 1;
};

/// Unit normal of a flat polygon; up where it has no area.
Vec3d normal_of(const std::vector<Vec3d>& corners);

/// The polygons of a mesh as flat sheets. A level polygon is one sheet. Others are as many as they have
/// height triangles, or where these do not fit the polygon, triangles between its corners.
class PolySheets {
 public:
  explicit PolySheets(const PolyMesh& mesh) : mesh_(mesh), parts_(mesh.corners.size()) {}

  /// Adds the sheets of a polygon. True where they are its height triangles, in order.
  bool add(PolyId id);

  const std::vector<Sheet>& all() const noexcept { return all_; }
  /// The parts of a polygon's edge.
  const std::vector<Part>& parts(std::uint32_t edge) const { return parts_[edge]; }

 private:
  bool level(const PolyMesh::Poly& p, const std::vector<Vec3d>& corners) const;

  /// The height triangles as sheets. False where they are no proper mesh of the polygon.
  bool from_heights(PolyId id, std::vector<Sheet>& own) const;

  const PolyMesh& mesh_;
  std::vector<Sheet> all_;
  std::vector<std::vector<Part>> parts_;
};

}  // namespace gsnav::detail
