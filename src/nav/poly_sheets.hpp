// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "poly_mesh.hpp"

namespace gsnav::detail {

/// A face before its sides are split at the corners of its neighbours.
struct Sheet {
  static constexpr std::uint32_t kInside = 0xffffffffu;

  PolyId poly = 0;
  std::vector<Vec3d> corners;
  std::vector<std::uint32_t> sides;  ///< Edge of the polygon that each edge lies on, or kInside.
};

/// Part of a polygon's edge: the edge of a sheet that lies on it, between the fractions t0 and t1 of its
/// length.
struct EdgePart {
  std::size_t sheet = 0, edge = 0;
  double t0 = 0, t1 = 1;
};

/// Unit normal of a flat polygon. Up if it has no area.
Vec3d normal_of(const std::vector<Vec3d>& corners);

/// Polygons of a mesh as flat sheets. A level polygon is one sheet. Another polygon has one sheet per
/// height triangle, or triangles between its corners if the height triangles do not fit it.
class PolySheets {
 public:
  explicit PolySheets(const PolyMesh& mesh) : mesh_(mesh), parts_(mesh.corners.size()) {}

  /// Adds the sheets of a polygon. Returns true if they are its height triangles, in order.
  bool add(PolyId id);

  const std::vector<Sheet>& all() const noexcept { return all_; }
  /// Parts of a polygon's edge.
  const std::vector<EdgePart>& parts(std::uint32_t edge) const { return parts_[edge]; }

 private:
  bool level(const PolyMesh::Poly& p, const std::vector<Vec3d>& corners) const;

  /// Uses the height triangles as sheets. Returns false if they do not tile the polygon.
  bool from_heights(PolyId id, std::vector<Sheet>& own) const;

  const PolyMesh& mesh_;
  std::vector<Sheet> all_;
  std::vector<std::vector<EdgePart>> parts_;
};

}  // namespace gsnav::detail
