// SPDX-License-Identifier: Apache-2.0
#include "poly_sheets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ground_plane.hpp"

namespace gsnav::detail {
namespace {

constexpr double kLevel = 1e-3;         // Metres. A polygon that deviates less from a plane is one face.
constexpr double kSampleBeside = 1e-2;  // Largest distance of a height sample from the edge of its
                                        // polygon, metres.
constexpr double kNoArea = 1e-8;        // Largest area that counts as 0, m².

/// Cuts a polygon into triangles by ear clipping, the best-shaped ear first.
std::vector<Sheet> clipped(PolyId id, const std::vector<Vec3d>& c) {
  std::vector<Sheet> own;
  std::vector<std::uint32_t> left;
  const auto n = static_cast<std::uint32_t>(c.size());
  for (std::uint32_t k = 0; k < n; ++k) left.push_back(k);
  while (left.size() >= 3) {
    std::size_t ear = 0;
    double best = -1;
    for (std::size_t k = 0; k < left.size(); ++k) {
      const Vec3d &a = c[left[(k + left.size() - 1) % left.size()]], &b = c[left[k]],
                  &d = c[left[(k + 1) % left.size()]];
      const double quality = area_xz(a, b, d) / gsnav::dot(d - a, d - a);
      if (quality > best) {
        best = quality;
        ear = k;
      }
    }
    const std::uint32_t i[3] = {left[(ear + left.size() - 1) % left.size()], left[ear],
                                left[(ear + 1) % left.size()]};
    Sheet s{id, {c[i[0]], c[i[1]], c[i[2]]}, {}};
    for (std::size_t e = 0; e < 3; ++e) {
      s.sides.push_back(i[(e + 1) % 3] == (i[e] + 1) % n ? i[e] : Sheet::kInside);
    }
    own.push_back(std::move(s));
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return own;
}

}  // namespace

Vec3d normal_of(const std::vector<Vec3d>& c) {
  Vec3d n{};
  for (std::size_t k = 1; k + 1 < c.size(); ++k) n += gsnav::cross(c[k + 1] - c[0], c[k] - c[0]);
  const double l = norm(n);
  return l > 0 ? n * (1.0 / l) : Vec3d{0, 1, 0};
}

bool PolySheets::add(PolyId id) {
  const PolyMesh::Poly& p = mesh_.polys[id];
  bool by_triangle = false;
  std::vector<Vec3d> corners(mesh_.corners.begin() + p.first, mesh_.corners.begin() + p.first + p.count);
  std::vector<Sheet> own;
  if (level(p, corners)) {
    own.push_back({id, std::move(corners), {}});
    for (std::uint32_t k = 0; k < p.count; ++k) own[0].sides.push_back(k);
  } else {
    by_triangle = from_heights(id, own);
    if (!by_triangle) own = clipped(id, corners);
  }
  for (Sheet& s : own) {
    for (std::size_t e = 0; e < s.sides.size(); ++e) {
      if (s.sides[e] == Sheet::kInside) continue;
      const Vec3d &a = mesh_.corner(p, s.sides[e]), &b = mesh_.corner(p, s.sides[e] + 1);
      const double t0 = fraction_xz(a, b, s.corners[e]);
      const double t1 = fraction_xz(a, b, s.corners[(e + 1) % s.corners.size()]);
      parts_[p.first + s.sides[e]].push_back({all_.size(), e, t0, t1});
    }
    all_.push_back(std::move(s));
  }
  return by_triangle;
}

bool PolySheets::level(const PolyMesh::Poly& p, const std::vector<Vec3d>& corners) const {
  const Vec3d n = normal_of(corners);
  const auto off = [&](const Vec3d& q) { return std::abs(gsnav::dot(n, q - corners[0])) > kLevel; };
  if (!(n.y > 0.1) || std::any_of(corners.begin(), corners.end(), off)) return false;
  for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
    const std::array<Vec3d, 3> tri = mesh_.triangle(mesh_.tris[t]);
    if (std::any_of(tri.begin(), tri.end(), off)) return false;
  }
  return true;
}

bool PolySheets::from_heights(PolyId id, std::vector<Sheet>& own) const {
  const PolyMesh::Poly& p = mesh_.polys[id];
  std::vector<double> covered(p.count, 0.0);
  for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
    std::array<Vec3d, 3> tri = mesh_.triangle(mesh_.tris[t]);
    if (area_xz(tri[0], tri[1], tri[2]) < 0) std::swap(tri[1], tri[2]);
    if (!(area_xz(tri[0], tri[1], tri[2]) > kNoArea)) return false;
    own.push_back({id, {tri.begin(), tri.end()}, {Sheet::kInside, Sheet::kInside, Sheet::kInside}});
  }
  const auto shared = [&](const Vec3d& a, const Vec3d& b) {
    return std::any_of(own.begin(), own.end(), [&](const Sheet& s) {
      return (s.corners[0] == b && s.corners[1] == a) || (s.corners[1] == b && s.corners[2] == a) ||
             (s.corners[2] == b && s.corners[0] == a);
    });
  };
  for (Sheet& s : own) {
    for (std::size_t e = 0; e < 3; ++e) {
      const Vec3d &a = s.corners[e], &b = s.corners[(e + 1) % 3];
      if (shared(a, b)) continue;
      double best = kSampleBeside;
      for (std::uint32_t k = 0; k < p.count; ++k) {
        const auto [ta, da] = along_xz(mesh_.corner(p, k), mesh_.corner(p, k + 1), a);
        const auto [tb, db] = along_xz(mesh_.corner(p, k), mesh_.corner(p, k + 1), b);
        if (max(da, db) >= best || !(tb > ta)) continue;
        best = max(da, db);
        s.sides[e] = k;
      }
      if (s.sides[e] == Sheet::kInside) return false;
      const Vec3d &u = mesh_.corner(p, s.sides[e]), &v = mesh_.corner(p, s.sides[e] + 1);
      covered[s.sides[e]] += fraction_xz(u, v, b) - fraction_xz(u, v, a);
    }
  }
  return std::all_of(covered.begin(), covered.end(), [](double c) { return std::abs(c - 1) < 1e-3; });
}

}  // namespace gsnav::detail
