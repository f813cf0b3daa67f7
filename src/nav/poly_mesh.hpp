// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alias_table.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "poly_grid.hpp"

namespace gsnav::detail {

/// Factor that shortens a displacement so that its squares do not overflow. 1 up to 1e100 m. A longer
/// displacement leaves every mesh at a fraction that rounds to zero.
inline double shortened(double dx, double dz) noexcept {
  constexpr double kLongest = 1e100;
  return kLongest / max(max(abs(dx), abs(dz)), kLongest);
}

/// Convex polygons of a NavMesh in double, relative to the mesh's origin, counter-clockwise in (x, z),
/// with the neighbour across each edge. Walking, heights, islands and sampling use it without Detour.
struct PolyMesh {
  struct Poly {
    std::uint32_t first = 0, count = 0;          ///< Range of its edges and corners.
    std::uint32_t tri_first = 0, tri_count = 0;  ///< Range of its height triangles.
    std::uint32_t island = 0;
    double area = 0.0;
    bool planar = false;            ///< Corners and height triangles lie in one plane.
    bool tiled = false;             ///< Its pieces are its height triangles.
    double rise_x = 0, rise_z = 0;  ///< Slope of that plane along x and z.
  };
  using Corners = std::array<std::uint32_t, 3>;
  /// Gradient of a corner's share of a height triangle along x and z, per metre.
  struct Share {
    double x = 0, z = 0;
  };
  struct Island {
    std::uint32_t first = 0, count = 0;  ///< Range in `by_island`.
    double area = 0.0, radius = 0.0;
  };

  std::vector<Poly> polys;
  std::vector<Vec3d> corners;      ///< Edge k of a polygon runs from corner k to the next one.
  std::vector<PolyId> neighbours;  ///< Neighbour across each edge, kNoPoly at a wall.
  // Small records in separate arrays. A file has 4 bytes per height triangle, and no array may exceed
  // four times the file size.
  std::vector<Vec3d> points;  ///< Vertices of height triangles. For each Detour tile, its vertices, then
                              ///< its height samples.
  std::vector<Corners> tris;  ///< Height triangles by polygon, as indices into `points`.
  std::vector<Share> share_1,
      share_2;  ///< For corners 1 and 2 of `tris`. Zero if the triangle has no area on the ground.
  std::vector<Island> islands;    ///< By decreasing area.
  std::vector<PolyId> by_island;  ///< Polygons, ordered by island.
  double total_area = 0.0;
  /// Triangle to sample points from. If its polygon is neither tiled nor planar, the height of a sample
  /// is that of the polygon.
  struct Piece {
    Corners at{};  ///< Indices into `points` if the polygon is tiled, else into `corners`.
    PolyId poly = 0;
  };
  std::vector<Piece> pieces;           ///< All pieces together cover the surface.
  AliasTable by_area;                  ///< Samples `pieces`.
  std::vector<AliasTable> by_area_in;  ///< Samples the pieces of each island.
  PolyGrid grid;

  /// Computes everything that depends on polys, corners, neighbours, points and tris.
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
  /// Returns true if (x, z) of q is inside the polygon or within `margin` metres of an edge.
  bool holds(PolyId id, const Vec3d& q, double margin) const noexcept;
  /// q, moved on the ground plane to the nearest point of the polygon. Points inside are not changed.
  Vec3d clamped(PolyId id, const Vec3d& q) const noexcept;
  /// Height of the surface at (x, z) of q.
  double height(PolyId id, const Vec3d& q) const noexcept;
  /// Random point of a piece, uniform.
  Vec3d point_in(const Piece& piece, Rng& rng) const noexcept;
  /// See NavMesh::walk. Positions are relative to the mesh's origin.
  void walk(PolyId start_poly, const Vec3d& start, double dx, double dz, bool slide,
            SurfaceWalk& out) const;

 private:
  void prepare_heights();
  void prepare_sampling();
  void add_pieces(PolyId id);
};

}  // namespace gsnav::detail
