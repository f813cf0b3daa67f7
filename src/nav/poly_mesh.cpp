// SPDX-License-Identifier: Apache-2.0
#include "poly_mesh.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include "ground_plane.hpp"

namespace gsnav::detail {
namespace {

std::uint32_t find_root(std::vector<std::uint32_t>& parent, std::uint32_t i) noexcept {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

bool PolyMesh::holds(PolyId id, const Vec3d& q, double margin) const noexcept {
  const Vec3d c = clamped(id, q);
  return distance2_xz(c, q) <= margin * margin;
}

Vec3d PolyMesh::clamped(PolyId id, const Vec3d& q) const noexcept {
  const Poly& p = polys[id];
  bool inside = true;
  for (std::uint32_t k = 0; k < p.count && inside; ++k)
    inside = !(area_xz(corner(p, k), corner(p, k + 1), q) < 0);
  if (inside) return q;
  double best = std::numeric_limits<double>::max();
  Vec3d nearest = q;
  for (std::uint32_t k = 0; k < p.count; ++k) {
    const Vec3d n = nearest_xz(corner(p, k), corner(p, k + 1), q);
    const double d2 = distance2_xz(n, q);
    if (d2 < best) {
      best = d2;
      nearest = {n.x, q.y, n.z};
    }
  }
  return nearest;
}

double PolyMesh::height(PolyId id, const Vec3d& q) const noexcept {
  const Poly& p = polys[id];
  if (p.count == 0) return q.y;
  const Vec3d& o = corners[p.first];
  if (p.planar) return o.y + p.rise_x * (q.x - o.x) + p.rise_z * (q.z - o.z);
  // Use the triangle that contains q, or else the one that q misses least. Points on edges therefore
  // always find one.
  double best = -std::numeric_limits<double>::max(), y = o.y;
  for (std::uint32_t i = p.tri_first; i < p.tri_first + p.tri_count; ++i) {
    const Share &s = share_1[i], &t = share_2[i];
    const Vec3d& a = points[tris[i][0]];
    const double dx = q.x - a.x, dz = q.z - a.z, u = s.x * dx + s.z * dz, v = t.x * dx + t.z * dz;
    const double w = 1.0 - u - v, least = min(u, min(v, w));
    if (least <= best || (s.x == 0 && s.z == 0)) continue;
    best = least;
    const double rise_u = points[tris[i][1]].y - a.y, rise_v = points[tris[i][2]].y - a.y;
    if (least >= 0) return a.y + u * rise_u + v * rise_v;
    const double cu = max(u, 0.0), cv = max(v, 0.0);
    y = a.y + (cu * rise_u + cv * rise_v) / (cu + cv + max(w, 0.0));
  }
  return y;
}

void PolyMesh::prepare_heights() {
  share_1.assign(tris.size(), {});
  share_2.assign(tris.size(), {});
  for (std::size_t i = 0; i < tris.size(); ++i) {
    const auto [a, b, c] = triangle(tris[i]);
    const double area = area_xz(a, b, c);
    if (!(std::abs(area) > 1e-12)) continue;
    share_1[i] = {(c.z - a.z) / area, (a.x - c.x) / area};
    share_2[i] = {(a.z - b.z) / area, (b.x - a.x) / area};
  }
}

void PolyMesh::finish() {
  std::vector<std::uint32_t> parent(polys.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (std::uint32_t i = 0; i < polys.size(); ++i) {
    Poly& p = polys[i];
    p.area = 0;
    for (std::uint32_t k = 1; k + 1 < p.count; ++k) {
      p.area += 0.5 * norm(cross(corner(p, k) - corner(p, 0), corner(p, k + 1) - corner(p, 0)));
    }
    for (std::uint32_t k = 0; k < p.count; ++k) {
      const PolyId n = neighbours[p.first + k];
      if (n == kNoPoly) continue;
      const std::uint32_t a = find_root(parent, i), b = find_root(parent, n);
      parent[max(a, b)] = min(a, b);
    }
  }
  // Number islands by decreasing area. Equal areas are ordered by their smallest polygon.
  std::vector<std::uint32_t> roots;
  std::vector<double> root_area(polys.size(), 0.0);
  for (std::uint32_t i = 0; i < polys.size(); ++i) {
    const std::uint32_t r = find_root(parent, i);
    if (r == i) roots.push_back(i);
    root_area[r] += polys[i].area;
  }
  std::stable_sort(roots.begin(), roots.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return root_area[a] > root_area[b]; });
  std::vector<std::uint32_t> island_of_root(polys.size(), 0);
  islands.assign(roots.size(), {});
  for (std::uint32_t k = 0; k < roots.size(); ++k) {
    island_of_root[roots[k]] = k;
    islands[k].area = root_area[roots[k]];
  }
  for (std::uint32_t i = 0; i < polys.size(); ++i) {
    polys[i].island = island_of_root[find_root(parent, i)];
  }
  by_island.resize(polys.size());
  std::iota(by_island.begin(), by_island.end(), 0u);
  std::stable_sort(by_island.begin(), by_island.end(),
                   [&](PolyId a, PolyId b) { return polys[a].island < polys[b].island; });
  total_area = 0;
  for (std::uint32_t i = 0; i < by_island.size(); ++i) {
    Island& island = islands[polys[by_island[i]].island];
    if (island.count++ == 0) island.first = i;
    total_area += polys[by_island[i]].area;
  }
  for (Island& island : islands) {
    Vec3d centroid{};
    double weight = 0;
    for (std::uint32_t i = island.first; i < island.first + island.count; ++i) {
      const Poly& p = polys[by_island[i]];
      for (std::uint32_t k = 1; k + 1 < p.count; ++k) {
        const Vec3d &a = corner(p, 0), &b = corner(p, k), &c = corner(p, k + 1);
        const double area = norm(cross(b - a, c - a));
        centroid += (a + b + c) * (area / 3.0);
        weight += area;
      }
    }
    if (weight > 0) centroid = centroid * (1.0 / weight);
    double r2 = 0;
    for (std::uint32_t i = island.first; i < island.first + island.count; ++i) {
      const Poly& p = polys[by_island[i]];
      for (std::uint32_t k = 0; k < p.count; ++k) r2 = max(r2, distance2_xz(corner(p, k), centroid));
    }
    island.radius = std::sqrt(r2);
  }
  prepare_heights();
  prepare_sampling();
  grid.build(*this);
}

/// Splits a polygon into sampling pieces: its height triangles if they tile it, else a fan of triangles.
void PolyMesh::add_pieces(PolyId id) {
  Poly& p = polys[id];
  constexpr double kOff = 1e-5;  // Metres. Error of float32 corners some hundred metres from the origin.
  double area = 0, covered = 0, around = 0;
  for (std::uint32_t k = 1; k + 1 < p.count; ++k)
    area += area_xz(corner(p, 0), corner(p, k), corner(p, k + 1));
  for (std::uint32_t k = 0; k < p.count; ++k)
    around += std::sqrt(distance2_xz(corner(p, k), corner(p, k + 1)));
  bool tiled = !p.planar;
  const std::size_t first = pieces.size();
  for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count && tiled; ++t) {
    const auto [a, b, c] = triangle(tris[t]);
    covered += std::abs(area_xz(a, b, c));
    for (const Vec3d& q : {a, b, c}) tiled = tiled && holds(id, q, kOff);
    pieces.push_back({tris[t], id});
  }
  // A sliver may have no height triangles, but every polygon needs a piece.
  p.tiled = tiled && pieces.size() > first && std::abs(covered - std::abs(area)) <= kOff * around;
  if (p.tiled) return;
  pieces.resize(first);
  for (std::uint32_t k = 1; k + 1 < p.count; ++k)
    pieces.push_back({{p.first, p.first + k, p.first + k + 1}, id});
}

void PolyMesh::prepare_sampling() {
  std::vector<double> weights;
  std::vector<std::vector<double>> weights_in(islands.size());
  std::vector<std::vector<std::uint32_t>> pieces_in(islands.size());
  std::size_t most = 0;
  for (const Poly& p : polys) most += max(p.tri_count, max(p.count, 2u) - 2);
  pieces.reserve(most);
  weights.reserve(most);
  for (PolyId i = 0; i < polys.size(); ++i) {
    Poly& p = polys[i];
    const Vec3d& o = corner(p, 0);
    Vec3d normal{};
    for (std::uint32_t k = 1; k + 1 < p.count; ++k)
      normal += cross(corner(p, k + 1) - o, corner(p, k) - o);
    const double scale = norm(normal);
    const auto off = [&](const Vec3d& q) { return !(std::abs(dot(normal, q - o)) <= 1e-6 * scale); };
    p.planar = std::abs(normal.y) > 1e-3 * scale;
    p.rise_x = p.planar ? -normal.x / normal.y : 0.0;
    p.rise_z = p.planar ? -normal.z / normal.y : 0.0;
    for (std::uint32_t k = 1; k < p.count; ++k) p.planar = p.planar && !off(corner(p, k));
    for (std::uint32_t t = p.tri_first; t < p.tri_first + p.tri_count; ++t) {
      for (const std::uint32_t v : tris[t]) p.planar = p.planar && !off(points[v]);
    }
    const std::size_t first = pieces.size();
    add_pieces(i);
    for (std::size_t k = first; k < pieces.size(); ++k) {
      const auto [o1, a1, b1] = triangle(pieces[k]);
      weights.push_back(0.5 * norm(cross(a1 - o1, b1 - o1)));
      weights_in[p.island].push_back(weights.back());
      pieces_in[p.island].push_back(static_cast<std::uint32_t>(k));
    }
  }
  by_area = AliasTable(weights, {});
  for (std::size_t i = 0; i < islands.size(); ++i) by_area_in.emplace_back(weights_in[i], pieces_in[i]);
}

Vec3d PolyMesh::point_in(const Piece& piece, Rng& rng) const noexcept {
  const auto [o, a, b] = triangle(piece);
  double u = rng.uniform(), v = rng.uniform();
  const bool beyond = u + v > 1;  // Reflect points of the other half of the parallelogram. Branch-free,
                                  // because both halves are equally likely.
  u = beyond ? 1 - u : u;
  v = beyond ? 1 - v : v;
  Vec3d q{o.x + u * (a.x - o.x) + v * (b.x - o.x), o.y + u * (a.y - o.y) + v * (b.y - o.y),
          o.z + u * (a.z - o.z) + v * (b.z - o.z)};
  if (const Poly& p = polys[piece.poly]; !p.tiled && !p.planar) q.y = height(piece.poly, q);
  return q;
}

}  // namespace gsnav::detail
