// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "unfolded_mesh.hpp"

namespace gsnav::detail {

std::uint32_t UnfoldedMesh::face_at(PolyId poly, const Vec3d& p) const noexcept {
  const std::uint32_t first = first_face[poly], last = first_face[poly + 1];
  if (last - first == 1) return first;
  const auto area = [&](const Face& f, std::uint32_t k) {
    const Vec3d &a = edges[f.first + k].corner,
                &b = edges[f.first + (k + 1 < f.count ? k + 1 : 0)].corner;
    return (b.x - a.x) * (p.z - a.z) - (p.x - a.x) * (b.z - a.z);
  };
  for (std::uint32_t i = first; i < last; ++i) {
    bool inside = true;
    for (std::uint32_t k = 0; k < faces[i].count && inside; ++k) inside = area(faces[i], k) >= 0;
    if (inside) return i;
  }
  std::uint32_t best = first;
  double best_inside = -std::numeric_limits<double>::max();
  for (std::uint32_t i = first; i < last; ++i) {
    double inside = std::numeric_limits<double>::max();
    for (std::uint32_t k = 0; k < faces[i].count; ++k) {
      const Vec3d &a = edges[faces[i].first + k].corner,
                  &b = edges[faces[i].first + (k + 1 < faces[i].count ? k + 1 : 0)].corner;
      inside = min(inside, area(faces[i], k) / max(std::hypot(b.x - a.x, b.z - a.z), 1e-12));
    }
    if (inside <= best_inside) continue;
    best_inside = inside;
    best = i;
  }
  return best;
}

Flat UnfoldedMesh::clamped(std::uint32_t face, const Flat& p) const noexcept {
  const Face& f = faces[face];
  Flat nearest = p;
  double best = std::numeric_limits<double>::max();
  bool inside = true;
  for (std::uint32_t k = 0; k < f.count; ++k) {
    const Flat &a = edges[f.first + k].at, &b = edges[f.first + (k + 1 < f.count ? k + 1 : 0)].at;
    const Flat side = b - a;
    inside = inside && cross(side, p - a) >= 0;
    const double t = segment_fraction(dot(p - a, side), dot(side, side));
    const Flat q = a + side * t;
    if (length(p - q) >= best) continue;
    best = length(p - q);
    nearest = q;
  }
  return inside ? p : nearest;
}

}  // namespace gsnav::detail
