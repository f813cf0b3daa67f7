// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "face_grid.hpp"
#include "flat.hpp"
#include "poly_mesh.hpp"

namespace gsnav::detail {

/// Dot product in 3D without fused multiply-add, as in flat.hpp.
inline double plain_dot(const Vec3d& a, const Vec3d& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// Distance in 3D.
inline double distance(const Vec3d& a, const Vec3d& b) noexcept {
  const Vec3d d = a - b;
  return std::sqrt(plain_dot(d, d));
}

/// Surface of a NavMesh as flat convex faces. Each face has its own plane coordinates, and each edge has
/// the transform to the neighbour's plane. A level polygon is one face; a polygon whose height triangles
/// leave its plane has one face per triangle. Shortest paths are straight in the unfolded faces and bend
/// only at vertices.
class UnfoldedMesh {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Edge of a face from one corner to the next, counter-clockwise. The index of an edge also denotes
  /// its first corner.
  struct Edge {
    Flat at;         ///< Corner in the plane of the face.
    Vec3d corner{};  ///< Corner in 3D.
    std::uint32_t face = 0;
    std::uint32_t twin = kNone;  ///< Edge of the neighbour. kNone at a wall.
    std::uint32_t vertex = 0;
    double cosine = 1, sine = 0, dx = 0, dy = 0;  ///< Transform from the plane of this face to that of
                                                  ///< the neighbour.
    bool same_plane = true;                       ///< That transform is the identity.
    double angle = 0;                             ///< Angle of this edge in the fan of its vertex.
  };
  struct Face {
    std::uint32_t first = 0, count = 0;  ///< Range of its edges.
    Vec3d u{1, 0, 0}, v{0, 0, 1};        ///< Axes of the plane, counter-clockwise in (x, z).
    PolyId poly = 0;
  };
  /// Fan of faces around a point. Surfaces that only touch at a point have separate vertices.
  struct Vertex {
    std::uint32_t first = 0, count = 0;  ///< Range in `fans`, counter-clockwise.
    double total = 0;                    ///< Total angle of the fan.
    bool closed = false;                 ///< No wall ends here.
    bool turning = false;                ///< A shortest path may bend here.
  };

  explicit UnfoldedMesh(const PolyMesh& mesh);

  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> fans;        ///< Edges that leave each vertex.
  std::vector<std::uint32_t> first_face;  ///< First face of each polygon, and one past the last.
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
    return {plain_dot(p, f.u), plain_dot(p, f.v)};
  }
  /// Transforms a point from the plane of the face of edge e to that of the neighbour across it.
  static Flat across(const Edge& e, const Flat& p) noexcept {
    if (e.same_plane) return p;
    return {e.cosine * p.x - e.sine * p.y + e.dx, e.sine * p.x + e.cosine * p.y + e.dy};
  }
  /// Face of a polygon that contains (x, z) of p, or else the one that p misses least.
  std::uint32_t face_at(PolyId poly, const Vec3d& p) const noexcept;
  /// Point of a face nearest to p, in its plane. p itself if it is inside.
  Flat clamped(std::uint32_t face, const Flat& p) const noexcept;

 private:
  void add_faces(const PolyMesh& mesh);
  void unfold();
  void fan_out();
};

}  // namespace gsnav::detail
