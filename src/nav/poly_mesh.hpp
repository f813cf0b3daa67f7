// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alias_table.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "poly_grid.hpp"

namespace gsnav::detail {

/// What a displacement over the ground is multiplied by so that its squares do not overflow; 1 up to
/// 1e100 m. Every mesh ends before a fraction of a longer one that a number can tell from zero.
inline double shortened(double dx, double dz) noexcept {
  constexpr double kLongest = 1e100;
  return kLongest / max(max(abs(dx), abs(dz)), kLongest);
}

/// The convex polygons of a NavMesh in double, relative to the mesh's origin, counter-clockwise in
/// (x, z), with the neighbour across each edge. Walking, heights, islands and sampling need no Detour.
struct PolyMesh {
  struct Poly {
    std::uint32_t first = 0, count = 0;          ///< edges and corners
    std::uint32_t tri_first = 0, tri_count = 0;  ///< height triangles
    std::uint32_t island = 0;
    double area = 0.0;
    bool planar = false;            ///< corners and height triangles lie in one plane
    bool tiled = false;             ///< its pieces are its height triangles
    double rise_x = 0, rise_z = 0;  ///< of that plane, a metre along x and z
  };
  using Corners = std::array<std::uint32_t, 3>;
  /// How a corner's share of a height triangle grows, a metre along x and z on the ground.
  struct Share {
    double x = 0, z = 0;
  };
  struct Island {
    std::uint32_t first = 0, count = 0;  ///< in `by_island`
    double area = 0.0, radius = 0.0;
  };

  std::vector<Poly> polys;
  std::vector<Vec3d> corners;      ///< edge k of a polygon runs from corner k to the next
  std::vector<PolyId> neighbours;  ///< across each edge; kNoPoly at a wall
  // Small records in arrays of their own: a file has 4 bytes a height triangle, and no array may be over
  // four times it.
  std::vector<Vec3d>
      points;  ///< of height triangles: of each of Detour's tiles vertices, then height samples
  std::vector<Corners> tris;  ///< height triangles, by polygon: which points
  std::vector<Share> share_1,
      share_2;  ///< of corners 1 and 2 of `tris`; zero where they have no area on the ground
  std::vector<Island> islands;    ///< by falling area
  std::vector<PolyId> by_island;  ///< polygons, island after island
  double total_area = 0.0;
  /// A triangle to draw points from; on the surface where its polygon is tiled or planar, else what is
  /// drawn has the height of the polygon there.
  struct Piece {
    Corners at{};  ///< of `points` where its polygon is tiled, else of `corners`
    PolyId poly = 0;
  };
  std::vector<Piece> pieces;           ///< together the whole surface
  AliasTable by_area;                  ///< of `pieces`
  std::vector<AliasTable> by_area_in;  ///< the same, by island
  PolyGrid grid;

  /// Fills everything that follows from polys, corners, neighbours, points and tris.
  void finish();

  const Vec3d& corner(const Poly& p, std::uint32_t k) const noexcept {
    return corners[p.first + (k < p.count ? k : k - p.count)];
  }
  std::array<Vec3d, 3> triangle(const Corners& t) const noexcept {
    return {points[t[0]], points[t[1]], points[t[2]]};
  }
  std::array<Vec3d, 3> triangle(const Piece& piece) const noexcept {
    const std::vector<Vec3d>& from = polys[piece.poly].tiled ? points : corners;
    return {from[piece.at[0]], from[piece.at[1]], from[piece.at[2]]};
  }
  /// True where (x, z) of q is inside or within `margin` metres of an edge.
  bool holds(PolyId id, const Vec3d& q, double margin) const noexcept;
  /// q moved on the ground plane to the nearest point of the polygon (unchanged inside).
  Vec3d clamped(PolyId id, const Vec3d& q) const noexcept;
  /// Height of the surface at (x, z) of q.
  double height(PolyId id, const Vec3d& q) const noexcept;
  /// A point of a piece, uniform.
  Vec3d point_in(const Piece& piece, Rng& rng) const noexcept;
  /// See NavMesh::walk; positions relative to the mesh's origin.
  void walk(PolyId start_poly, const Vec3d& start, double dx, double dz, bool slide,
            SurfaceWalk& out) const;

 private:
  void prepare_heights();
  void prepare_sampling();
  void add_pieces(PolyId id);
};

}  // namespace gsnav::detail
