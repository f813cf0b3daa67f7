// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "alias_table.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "poly_grid.hpp"

namespace gsnav::detail {

/// The convex polygons of a NavMesh in double, relative to the mesh's origin, counter-clockwise in
/// (x, z), with the neighbour across each edge. Walking, heights, islands and sampling need no Detour.
struct PolyMesh {
  struct Poly {
    std::uint32_t first = 0, count = 0;          ///< edges and corners
    std::uint32_t tri_first = 0, tri_count = 0;  ///< height triangles
    std::uint32_t island = 0;
    double area = 0.0;
    bool planar = false;  ///< corners and height triangles lie in one plane
    double rise_x = 0, rise_z = 0;  ///< of that plane, a metre along x and z
  };
  /// A height triangle as what it takes to find a point in it: shares of corners 1 and 2 are linear on the ground.
  struct Height {
    double x = 0, y = 0, z = 0;  ///< corner 0
    double ux = 0, uz = 0, vx = 0, vz = 0;
    double rise_u = 0, rise_v = 0;  ///< of corners 1 and 2 above corner 0
  };
  struct Island {
    std::uint32_t first = 0, count = 0;  ///< in `by_island`
    double area = 0.0, radius = 0.0;
  };

  std::vector<Poly> polys;
  std::vector<Vec3d> corners;               ///< edge k of a polygon runs from corner k to the next
  std::vector<PolyId> neighbours;           ///< across each edge; kNoPoly at a wall
  std::vector<std::array<Vec3d, 3>> tris;   ///< height triangles, by polygon
  std::vector<Height> heights;              ///< of `tris`; zero shares where they have no area on the ground
  std::vector<Island> islands;              ///< by falling area
  std::vector<PolyId> by_island;            ///< polygons, island after island
  double total_area = 0.0;
  /// A triangle to draw points from.
  struct Piece {
    Vec3d o{}, a{}, b{};
    PolyId poly = 0;
    bool on_surface = false;  ///< else its points have the height of the polygon there
  };
  std::vector<Piece> pieces;                         ///< together the whole surface
  AliasTable by_area;                                ///< of `pieces`
  std::vector<AliasTable> by_area_in;                ///< the same, by island
  PolyGrid grid;

  /// Fills everything that follows from polys, corners, neighbours and tris.
  void finish();

  const Vec3d& corner(const Poly& p, std::uint32_t k) const noexcept {
    return corners[p.first + (k < p.count ? k : k - p.count)];
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
