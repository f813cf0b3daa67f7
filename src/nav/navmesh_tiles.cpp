// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <compare>
#include <functional>

#include "ground_plane.hpp"
#include "height_mending.hpp"
#include "navmesh_impl.hpp"
#include "tile_seams.hpp"

namespace gsnav::detail {
namespace {

constexpr double kNarrow = 1e-3;  // Metres. Narrower portals between tiles are treated as walls.

Vec3d vec3(const float* p) noexcept {
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Vec3d corner_of(const dtMeshTile& tile, const dtPoly& p, std::size_t k) noexcept {
  return vec3(&tile.verts[3 * p.verts[k % p.vertCount]]);
}

/// Part of an edge that leads into another tile.
struct Portal {
  double from = 0, to = 0;  ///< Fractions of the edge's length.
  PolyId neighbour = kNoPoly;
  friend auto operator<=>(const Portal&, const Portal&) = default;
};

bool leads_out(const dtLink& link) noexcept { return link.side != 0xff; }

class Extractor {
 public:
  Extractor(NavMesh::Impl& impl, const std::function<double(const Vec3d&)>& height)
      : impl_(impl), mesh_(*impl.mesh), height_(height) {}

  void run() {
    for (int t = 0; t < mesh_.getMaxTiles(); ++t) {
      const dtMeshTile& tile = *mesh_.getTile(t);
      impl_.first_poly.push_back(static_cast<PolyId>(impl_.refs.size()));
      if (tile.header == nullptr) continue;
      const dtPolyRef base = mesh_.getPolyRefBase(&tile);
      for (int i = 0; i < tile.header->polyCount; ++i)
        impl_.refs.push_back(base | static_cast<dtPolyRef>(i));
    }
    reserve();
    std::vector<std::uint32_t> tile_of;
    for (int t = 0; t < mesh_.getMaxTiles(); ++t) {
      const dtMeshTile& tile = *mesh_.getTile(t);
      impl_.first_point.push_back(static_cast<std::uint32_t>(impl_.polys.points.size()));
      if (tile.header == nullptr) continue;
      add_points(tile.verts, tile.header->vertCount);
      add_points(tile.detailVerts, tile.header->detailVertCount);
      for (int i = 0; i < tile.header->polyCount; ++i) add(t, tile, i);
      tile_of.resize(impl_.polys.polys.size(), static_cast<std::uint32_t>(t));
    }
    mend_heights(impl_.polys);
    if (!tile_of.empty() && tile_of.front() != tile_of.back()) close_seams(impl_.polys, tile_of);
    impl_.polys.corners.shrink_to_fit();
    impl_.polys.neighbours.shrink_to_fit();
    impl_.polys.finish();
  }

 private:
  /// Reserves memory, so that nothing is allocated twice.
  void reserve() {
    std::size_t points = 0, tris = 0, corners = 0;
    for (int t = 0; t < mesh_.getMaxTiles(); ++t) {
      const dtMeshTile& tile = *mesh_.getTile(t);
      if (tile.header == nullptr) continue;
      points += static_cast<std::size_t>(tile.header->vertCount + tile.header->detailVertCount);
      for (int i = 0; i < tile.header->polyCount; ++i) {
        const dtPoly& p = tile.polys[i];
        tris += tile.detailMeshes[i].triCount;
        corners += p.vertCount;
        // A link to another tile adds a part, with at most one other part before it.
        for (unsigned l = p.firstLink; l != DT_NULL_LINK; l = tile.links[l].next) {
          corners += leads_out(tile.links[l]) ? 2 : 0;
        }
      }
    }
    impl_.polys.polys.reserve(impl_.refs.size());
    impl_.polys.points.reserve(points);
    impl_.polys.tris.reserve(tris);
    impl_.polys.corners.reserve(corners);
    impl_.polys.neighbours.reserve(corners);
  }

  void add_points(const float* p, int count) {
    for (int i = 0; i < count; ++i) impl_.polys.points.push_back(moved(vec3(p + 3 * i)));
  }

  void add(int tile_index, const dtMeshTile& tile, int i) {
    const dtPoly& p = tile.polys[i];
    std::vector<Vec3d> v;
    std::vector<PolyId> n;
    double twice = 0;
    for (std::size_t k = 0; k < p.vertCount; ++k) {
      const Vec3d a = corner_of(tile, p, k), b = corner_of(tile, p, k + 1);
      twice += a.x * b.z - b.x * a.z;
      if (p.neis[k] == 0 || (p.neis[k] & DT_EXT_LINK) == 0) {
        v.push_back(a);
        n.push_back(p.neis[k] == 0
                        ? kNoPoly
                        : impl_.first_poly[static_cast<std::size_t>(tile_index)] + p.neis[k] - 1u);
        continue;
      }
      double at = 0;
      const auto stretch = [&](double to, PolyId neighbour) {
        if (!(to > at)) return;
        v.push_back(lerp(a, b, at));
        n.push_back(neighbour);
        at = to;
      };
      const double weld = kNarrow / max(norm(b - a), kNarrow);
      for (const Portal& portal : portals(tile, i, k)) {
        if (portal.from > at + weld) stretch(portal.from, kNoPoly);
        stretch(portal.to, portal.neighbour);
      }
      if (at < 1 - weld || at == 0) stretch(1, kNoPoly);
    }
    PolyMesh::Poly poly;
    PolyMesh& out = impl_.polys;
    poly.first = static_cast<std::uint32_t>(out.corners.size());
    poly.count = static_cast<std::uint32_t>(v.size());
    for (std::size_t k = 0; k < v.size(); ++k) {
      // Reversed, edge k runs from corner count-1-k to the one before it.
      const bool reversed = twice < 0;
      out.corners.push_back(moved(v[reversed ? v.size() - 1 - k : k]));
      out.neighbours.push_back(n[reversed ? (2 * v.size() - 2 - k) % v.size() : k]);
    }
    poly.tri_first = static_cast<std::uint32_t>(out.tris.size());
    const dtPolyDetail& d = tile.detailMeshes[i];
    const std::uint32_t vertices = impl_.first_point.back();
    const std::uint32_t samples =
        vertices + static_cast<std::uint32_t>(tile.header->vertCount) + d.vertBase;
    for (unsigned t = 0; t < d.triCount; ++t) {
      const unsigned char* ids = &tile.detailTris[4 * (d.triBase + t)];
      PolyMesh::Corners tri;
      for (std::size_t k = 0; k < 3; ++k) {
        tri[k] = ids[k] < p.vertCount ? vertices + p.verts[ids[k]] : samples + ids[k] - p.vertCount;
      }
      out.tris.push_back(tri);
    }
    poly.tri_count = static_cast<std::uint32_t>(out.tris.size()) - poly.tri_first;
    out.polys.push_back(poly);
  }

  Vec3d moved(Vec3d p) const {
    if (height_) p.y = height_(p);
    return p;
  }

  /// Parts of edge k that touch edges of other tiles. Detour stores them in steps of 1/255; the edges
  /// are exact.
  std::vector<Portal> portals(const dtMeshTile& tile, int i, std::size_t k) const {
    std::vector<Portal> out;
    const dtPoly& p = tile.polys[i];
    const dtPolyRef self = mesh_.getPolyRefBase(&tile) | static_cast<dtPolyRef>(i);
    const Vec3d a = corner_of(tile, p, k), b = corner_of(tile, p, k + 1);
    const double len2 = distance2_xz(a, b);
    if (!(len2 > 0)) return out;
    std::size_t links = 0;
    for (unsigned l = p.firstLink; l != DT_NULL_LINK; l = tile.links[l].next) {
      if (tile.links[l].edge != k || !leads_out(tile.links[l])) continue;
      ++links;
      const dtMeshTile* other = nullptr;
      const dtPoly* q = nullptr;
      mesh_.getTileAndPolyByRefUnsafe(tile.links[l].ref, &other, &q);
      for (unsigned m = q->firstLink; m != DT_NULL_LINK; m = other->links[m].next) {
        if (other->links[m].ref != self || !leads_out(other->links[m])) continue;
        const Vec3d c = corner_of(*other, *q, other->links[m].edge),
                    d = corner_of(*other, *q, other->links[m].edge + 1u);
        const double s = fraction_xz(a, b, c), e = fraction_xz(a, b, d);
        if (std::abs(e - s) * std::sqrt(len2) > kNarrow &&
            within_climb(a, b, c, d, min(s, e), max(s, e))) {
          out.push_back({min(s, e), max(s, e), impl_.id_of(tile.links[l].ref)});
        }
      }
    }
    // If two edges of one polygon lie on this edge, each is found through both links. Remove the
    // duplicates.
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    if (out.size() > links) out.resize(links);
    return out;
  }

  /// Returns true if edge c d of another tile is within the agent's climb height of edge a b, between
  /// the fractions `from` and `to` of a b. Detour links edges within twice the climb height, for example
  /// a shelf and the floor below it.
  bool within_climb(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, double from,
                    double to) const {
    const NavMeshSettings& s = impl_.settings;
    const double most = (std::floor(s.agent_max_climb / s.cell_height + 1e-6) + 0.5) * s.cell_height;
    const auto rise = [&](double t) {
      const Vec3d at = a + (b - a) * t;
      return nearest_xz(c, d, at).y - at.y;
    };
    const double r0 = rise(from), r1 = rise(to);
    return r0 * r1 < 0 || min(std::abs(r0), std::abs(r1)) <= most;
  }

  NavMesh::Impl& impl_;
  const dtNavMesh& mesh_;
  const std::function<double(const Vec3d&)>& height_;
};

}  // namespace

NavMesh assemble_navmesh(const NavMeshSettings& settings, const Vec3d& origin, NavMeshPtr mesh,
                         const std::function<double(const Vec3d&)>& height) {
  auto impl = std::make_unique<NavMesh::Impl>();
  impl->settings = settings;
  impl->origin = origin;
  impl->mesh = std::move(mesh);
  Extractor(*impl, height).run();
  for (const auto& t : impl->polys.tris) {
    for (const std::uint32_t p : t) impl->bounds.add(impl->polys.points[p] + origin);
  }
  return NavMesh(std::move(impl));
}

}  // namespace gsnav::detail
