// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "face_grid.hpp"
#include "poly_mesh.hpp"

namespace gsnav::detail {

/// A point of a face in the face's own plane.
struct Flat {
  double x = 0, y = 0;
};
inline Flat operator-(const Flat& a, const Flat& b) noexcept { return {a.x - b.x, a.y - b.y}; }
inline Flat operator+(const Flat& a, const Flat& b) noexcept { return {a.x + b.x, a.y + b.y}; }
inline Flat operator*(const Flat& a, double s) noexcept { return {a.x * s, a.y * s}; }
inline double cross(const Flat& a, const Flat& b) noexcept { return a.x * b.y - a.y * b.x; }
inline double dot(const Flat& a, const Flat& b) noexcept { return a.x * b.x + a.y * b.y; }
inline double length(const Flat& a) noexcept { return std::sqrt(dot(a, a)); }
/// Straight through space, without fused steps, which are calls where the processor is not known to have
/// them.
inline double distance(const Vec3d& a, const Vec3d& b) noexcept {
  const double x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
  return std::sqrt(x * x + y * y + z * z);
}

/// The surface of a NavMesh as flat convex faces, each with plane coordinates of its own, and the turn
/// that lays a face's neighbour into its plane. A level polygon is one face; a polygon whose height
/// triangles leave its plane is as many faces as triangles. Shortest paths on it are straight in the
/// unfolded faces and bend only at vertices.
class UnfoldedMesh {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Edge of a face from its corner to the next, counter-clockwise; the number of an edge also names its
  /// first corner.
  struct Edge {
    Flat at;         ///< the corner, in the face's plane
    Vec3d corner{};  ///< the corner
    std::uint32_t face = 0;
    std::uint32_t twin = kNone;  ///< the neighbour's edge; kNone at a wall
    std::uint32_t vertex = 0;
    double cosine = 1, sine = 0, dx = 0, dy = 0;  ///< from this face's plane to the neighbour's
    bool same_plane = true;                       ///< that is the identity
    double angle = 0;                             ///< of this edge in the fan of its vertex
  };
  struct Face {
    std::uint32_t first = 0, count = 0;  ///< edges
    Vec3d u{1, 0, 0}, v{0, 0, 1};        ///< axes of the plane, counter-clockwise in (x, z)
    PolyId poly = 0;
  };
  /// A fan of faces around a point: surfaces that only touch there have a vertex each.
  struct Vertex {
    std::uint32_t first = 0, count = 0;  ///< in `fans`, counter-clockwise
    double total = 0;                    ///< angle of the fan
    bool closed = false;                 ///< no wall ends here
    bool turning = false;                ///< a shortest path may bend here
  };

  explicit UnfoldedMesh(const PolyMesh& mesh);

  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> fans;        ///< edges leaving each vertex
  std::vector<std::uint32_t> first_face;  ///< of each polygon, and one past the last
  FaceGrid grid;

  std::uint32_t next(std::uint32_t e) const noexcept {
    const Face& f = faces[edges[e].face];
    return e + 1 == f.first + f.count ? f.first : e + 1;
  }
  std::uint32_t previous(std::uint32_t e) const noexcept {
    const Face& f = faces[edges[e].face];
    return e == f.first ? f.first + f.count - 1 : e - 1;
  }
  Flat flat(const Face& f, const Vec3d& p) const noexcept {
    return {p.x * f.u.x + p.y * f.u.y + p.z * f.u.z, p.x * f.v.x + p.y * f.v.y + p.z * f.v.z};
  }
  /// A point of the face of edge e in the plane of the neighbour across it.
  static Flat across(const Edge& e, const Flat& p) noexcept {
    if (e.same_plane) return p;
    return {e.cosine * p.x - e.sine * p.y + e.dx, e.sine * p.x + e.cosine * p.y + e.dy};
  }
  /// The face of a polygon that (x, z) of p is in, or least outside of.
  std::uint32_t face_at(PolyId poly, const Vec3d& p) const noexcept;
  /// The point of a face that is nearest to p, in its plane: p itself where it is inside.
  Flat clamped(std::uint32_t face, const Flat& p) const noexcept;

 private:
  void add_faces(const PolyMesh& mesh);
  void unfold();
  void fan_out();
};

}  // namespace gsnav::detail
