// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/image/pixel_center.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/detail/mesh/mesh_clip.hpp"

// From meshes to triangles on the image, ready for the rasteriser. All of it is computed in double, so
// that the pixels that a triangle owns are the same on every backend and in every precision.

namespace gsnav {

/// A vertex as seen by one camera.
struct MeshVertex {
  Vec3d position{};  ///< camera axes, metres
  MeshPoint point;   ///< valid if no clip code is set
  std::uint32_t code = 0;
};

/// Affine function of the pixel: value + x dx + y dy, with (dx, dy) counted from the centre of the first
/// pixel of a triangle's box.
template <class S>
struct PixelPlane {
  S value{}, x{}, y{};
  GSNAV_HD S at(S dx, S dy) const noexcept { return fma(x, dx, fma(y, dy, value)); }
};

/// A triangle ready for rasterisation, or one piece of a triangle that was clipped.
template <class S>
struct MeshTriangle {
  MeshPoint corner[3];          ///< clockwise on the screen, so that edge functions are positive inside
  std::int16_t x0, y0, x1, y1;  ///< half-open box of the pixels whose centres may be inside
  std::uint32_t placement, triangle;  ///< index of the placement, and of the triangle in its mesh
  PixelPlane<double> inverse_z;       ///< 1 / z, in 1 / metres
  S inverse_z_min,
      inverse_z_max;     ///< range of 1 / z over the corners. Values of a sliver's plane beyond it are
                         ///< clamped.
  PixelPlane<S> b1, b2;  ///< weights of corners 1 and 2 of the mesh's triangle, divided by z
  bool back;             ///< true if seen from behind
  bool masked;           ///< true for MeshAlpha::mask
};

/// Arguments for projecting, clipping and counting the triangles of one camera.
template <class S>
struct MeshSetupArgs {
  MeshCamera camera;
  View<const MeshPlacement> placements;
  View<const MeshChunk> vertex_chunks, triangle_chunks;
  View<MeshVertex> vertices;
  View<std::uint32_t> counts;      ///< [triangle chunks], number of pieces that may cover a pixel centre
  View<std::uint32_t> not_finite;  ///< [triangle chunks], number of triangles left out because a corner
                                   ///< is NaN or infinite
  View<std::uint64_t> offsets;     ///< [triangle chunks + 1], index of each chunk's first piece
  View<MeshTriangle<S>> triangles;
};

/// Transforms vertex i of a placement to camera axes and projects it to the lattice.
template <class S>
GSNAV_HD void project_mesh_vertex(const MeshSetupArgs<S>& args, const MeshPlacement& placement,
                                  std::size_t i) noexcept {
  MeshVertex& v = args.vertices[placement.first_vertex + i];
  v.position = placement.linear * vec_cast<double>(placement.mesh.vertices[i]) + placement.translation;
  v.code = args.camera.outcode(v.position);
  if ((v.code & (kMeshClipCodes | kMeshNotFinite)) == 0)
    v.point = project_to_lattice(args.camera, v.position);
}

/// Kernel that projects the vertices of a chunk.
template <class S>
struct ProjectMeshVertices {
  MeshSetupArgs<S> args;
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const MeshChunk chunk = args.vertex_chunks[c];
    const MeshPlacement& placement = args.placements[chunk.placement];
    const std::size_t end = chunk.end(placement.mesh.vertices.size);
    for (std::size_t i = chunk.begin; i < end; ++i) project_mesh_vertex(args, placement, i);
  }
};

namespace detail {

/// First pixel of a row of `size` whose centre is at or right of lattice coordinate x.
GSNAV_HD std::int32_t first_centre(std::int32_t x, int size) noexcept {
  constexpr std::int32_t kHalf = 1 << (kMeshSubpixelBits - 1);
  return (x + (size - 1) * kHalf + 2 * kHalf - 1) >> kMeshSubpixelBits;
}
/// Last pixel of a row of `size` whose centre is at or left of lattice coordinate x.
GSNAV_HD std::int32_t last_centre(std::int32_t x, int size) noexcept {
  constexpr std::int32_t kHalf = 1 << (kMeshSubpixelBits - 1);
  return (x + (size - 1) * kHalf) >> kMeshSubpixelBits;
}

/// Twice the signed area, positive if the corners are clockwise on the screen.
GSNAV_HD std::int64_t doubled_area(const MeshPoint& a, const MeshPoint& b, const MeshPoint& c) noexcept {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

/// Sets corners and box of a triangle. Returns false if it cannot cover a pixel centre, or is a back
/// face that is not drawn.
template <class S>
GSNAV_HD bool place_triangle(const MeshCamera& camera, bool two_sided, const MeshPoint& a,
                             const MeshPoint& b, const MeshPoint& c, MeshTriangle<S>& out) noexcept {
  const std::int64_t area = doubled_area(a, b, c);
  if (area == 0) return false;
  out.back = area > 0;  // counter-clockwise from outside gives a negative area, because y points down
  if (out.back && !two_sided) return false;
  out.corner[0] = a;
  out.corner[1] = out.back ? b : c;
  out.corner[2] = out.back ? c : b;
  const auto box = [](std::int32_t p, std::int32_t q, std::int32_t r, int size, std::int16_t& low,
                      std::int16_t& high) GSNAV_INLINED {
    const std::int32_t first = first_centre(min(p, min(q, r)), size);
    const std::int32_t last = last_centre(max(p, max(q, r)), size);
    low = static_cast<std::int16_t>(max(first, 0));
    high = static_cast<std::int16_t>(min(last, size - 1) + 1);
    return max(first, 0) <= min(last, size - 1);
  };
  return box(a.x, b.x, c.x, camera.width, out.x0, out.x1) &&
         box(a.y, b.y, c.y, camera.height, out.y0, out.y1);
}

/// Computes the planes that are interpolated over the triangle. With n = e1 x e2 the triangle's plane is
/// n.p = n.v0, so 1/z = n.r / n.v0 along the ray r = (u, v, 1). The weight of corner 1 divided by z is
/// r.c1, where c1 = q1 - n (q1.v0) / (n.v0) and q1 = e2 x n / n.n. Both are linear in r, even if the
/// triangle reaches behind the camera.
template <class S>
GSNAV_HD void interpolate_triangle(const MeshCamera& camera, const Vec3d& v0, const Vec3d& v1,
                                   const Vec3d& v2, double z_min, double z_max,
                                   MeshTriangle<S>& out) noexcept {
  out.inverse_z_min = S(1.0 / z_max);
  out.inverse_z_max = S(1.0 / z_min);
  const Vec3d e1 = v1 - v0, e2 = v2 - v0, n = cross(e1, e2);
  const double nn = dot(n, n), nv = dot(n, v0);
  out.inverse_z = {1.0 / z_min, 0, 0};
  out.b1 = out.b2 = {};
  const double inverse = 1.0 / nv;
  // edge-on: use its nearest depth and its first corner's colour
  if (!(nn > 0) || !is_finite(inverse)) return;
  const double px = pixel_center<double>(out.x0) - camera.half_width - camera.cx,
               py = pixel_center<double>(out.y0) - camera.half_height - camera.cy;
  const auto plane = [&](const Vec3d& c) GSNAV_INLINED {
    const double x = c.x / camera.fx, y = c.y / camera.fy;
    return PixelPlane<double>{fma(x, px, fma(y, py, c.z)), x, y};
  };
  const Vec3d per_depth = n * inverse;
  out.inverse_z = plane(per_depth);
  const auto weight = [&](const Vec3d& q) GSNAV_INLINED {
    const PixelPlane<double> p = plane(q - per_depth * dot(q, v0));
    return PixelPlane<S>{S(p.value), S(p.x), S(p.y)};
  };
  out.b1 = weight(cross(e2, n) * (1.0 / nn));
  out.b2 = weight(cross(n, e1) * (1.0 / nn));
}

/// Calls f(piece) for each piece of triangle t of placement `at` that may cover a pixel centre. With
/// `Full`, interpolated planes are computed as well. Returns false if a corner is not finite.
template <bool Full, class S, class F>
GSNAV_HD bool for_each_piece(const MeshSetupArgs<S>& args, std::uint32_t at, std::size_t t,
                             const F& f) noexcept {
  const MeshPlacement& placement = args.placements[at];
  const MeshVertex* const vertices = args.vertices.data + placement.first_vertex;
  const std::uint32_t* const index = placement.mesh.indices.data + 3 * t;
  const MeshVertex* v[3] = {vertices + index[0], vertices + index[1], vertices + index[2]};
  const std::uint32_t some = v[0]->code | v[1]->code | v[2]->code;
  if ((some & kMeshNotFinite) != 0) return false;
  if ((v[0]->code & v[1]->code & v[2]->code) != 0) return true;
  MeshTriangle<S> piece;
  piece.placement = at;
  piece.triangle = static_cast<std::uint32_t>(t);
  piece.masked = placement.mesh.alpha_mode == MeshAlpha::mask;
  const auto emit = [&](double z_min, double z_max) GSNAV_INLINED {
    if constexpr (Full) {
      interpolate_triangle(args.camera, v[0]->position, v[1]->position, v[2]->position, z_min, z_max,
                           piece);
    }
    f(piece);
  };
  if ((some & kMeshClipCodes) == 0) {
    const double z0 = v[0]->position.z, z1 = v[1]->position.z, z2 = v[2]->position.z;
    if (place_triangle(args.camera, placement.mesh.two_sided, v[0]->point, v[1]->point, v[2]->point,
                       piece)) {
      emit(min(z0, min(z1, z2)), max(z0, max(z1, z2)));
    }
    return true;
  }
  Vec3d corners[kMeshMostCorners] = {v[0]->position, v[1]->position, v[2]->position};
  const int n = clip_triangle(args.camera, some & kMeshClipCodes, corners);
  if (n < 3) return true;
  double z_min = corners[0].z, z_max = corners[0].z;
  MeshPoint points[kMeshMostCorners];
  for (int i = 0; i < n; ++i) {
    z_min = min(z_min, corners[i].z);
    z_max = max(z_max, corners[i].z);
    points[i] = project_to_lattice(args.camera, corners[i]);
  }
  for (int i = 2; i < n; ++i) {
    if (place_triangle(args.camera, placement.mesh.two_sided, points[0], points[i - 1], points[i],
                       piece)) {
      emit(z_min, z_max);
    }
  }
  return true;
}

/// Calls f(piece) for the pieces of all triangles of a chunk. Returns the number of triangles with a
/// corner that is not finite.
template <bool Full, class S, class F>
GSNAV_HD std::uint32_t for_each_piece_of_chunk(const MeshSetupArgs<S>& args, std::size_t c,
                                               const F& f) noexcept {
  const MeshChunk chunk = args.triangle_chunks[c];
  const std::size_t end = chunk.end(args.placements[chunk.placement].mesh.triangle_count());
  std::uint32_t not_finite = 0;
  for (std::size_t t = chunk.begin; t < end; ++t) {
    not_finite += for_each_piece<Full>(args, chunk.placement, t, f) ? 0 : 1;
  }
  return not_finite;
}

/// Exclusive prefix sums: offsets[i] is the sum of the counts before i, for i in [0, n]. Both may be the
/// same array.
template <class Count>
GSNAV_HD void exclusive_sums(const Count* counts, std::size_t n, std::uint64_t* offsets) noexcept {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t count = counts[i];
    offsets[i] = sum;
    sum += count;
  }
  offsets[n] = sum;
}

}  // namespace detail

/// Kernel that counts the pieces that the triangles of a chunk leave after clipping and culling.
template <class S>
struct CountMeshTriangles {
  MeshSetupArgs<S> args;
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    std::uint32_t n = 0;
    args.not_finite[c] = detail::for_each_piece_of_chunk<false>(
        args, c, [&n](const MeshTriangle<S>&) GSNAV_INLINED { ++n; });
    args.counts[c] = n;
  }
};

/// Kernel that computes the index of each chunk's first piece.
template <class S>
struct ScanMeshTriangles {
  MeshSetupArgs<S> args;
  GSNAV_HD void operator()(std::size_t) const noexcept {
    detail::exclusive_sums(args.counts.data, args.counts.size, args.offsets.data);
  }
};

/// Kernel that writes the pieces of a chunk.
template <class S>
struct WriteMeshTriangles {
  MeshSetupArgs<S> args;
  GSNAV_HD void operator()(std::size_t c) const noexcept {
    if (args.counts[c] == 0) return;
    MeshTriangle<S>* out = args.triangles.data + args.offsets[c];
    detail::for_each_piece_of_chunk<true>(
        args, c, [&out](const MeshTriangle<S>& t) GSNAV_INLINED { *out++ = t; });
  }
};

}  // namespace gsnav
