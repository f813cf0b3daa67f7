// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gsnav/detail/image/pinhole.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

// Clipping, and projection to the lattice of 2^-14 px on which coverage is decided exactly
// (docs/reference/composition.md).

namespace gsnav {

/// Bits of a pixel's fraction, and the largest distance of a vertex from the image's centre, in pixels.
/// With them, edge functions at pixel centres stay below 2^62.
inline constexpr int kMeshSubpixelBits = 14;
inline constexpr double kMeshGuard = 32768;

/// Reasons why a vertex cannot be projected (the first five, in the order of clipping), and the sides of
/// the image that it lies beyond.
enum MeshOutcode : std::uint32_t {
  kMeshNear = 1u << 0,
  kMeshGuardLeft = 1u << 1,
  kMeshGuardRight = 1u << 2,
  kMeshGuardTop = 1u << 3,
  kMeshGuardBottom = 1u << 4,
  kMeshLeft = 1u << 5,
  kMeshRight = 1u << 6,
  kMeshTop = 1u << 7,
  kMeshBottom = 1u << 8,
  kMeshNotFinite = 1u << 9,
};
inline constexpr int kMeshClipPlanes = 5;
inline constexpr std::uint32_t kMeshClipCodes = (1u << kMeshClipPlanes) - 1;
/// Clipping adds at most one corner per plane.
inline constexpr int kMeshMostCorners = 3 + kMeshClipPlanes;

/// Parameters of a camera for projecting meshes. Pixels are counted from the image's centre.
struct MeshCamera {
  double fx = 1, fy = 1;
  double cx = 0, cy = 0;  ///< principal point, relative to the image's centre
  double half_width = 0, half_height = 0;
  double near_plane = 0;
  int width = 0, height = 0;

  static MeshCamera of(const Camera& c) noexcept {
    return {c.fx,          c.fy,           c.cx - 0.5 * c.width, c.cy - 0.5 * c.height,
            0.5 * c.width, 0.5 * c.height, c.near_plane,         c.width,
            c.height};
  }
  /// Signed distance to side k (left, right, top, bottom) of the pixels that are at most half_x, half_y
  /// from the image's centre. Positive inside.
  GSNAV_HD double distance_to_side(int k, double half_x, double half_y, const Vec3d& p) const noexcept {
    const bool across = k < 2;
    const double f = across ? fx : fy, c = across ? cx : cy, half = across ? half_x : half_y;
    const auto side =
        k % 2 == 0 ? ImageSide<double>::first(f, c, half) : ImageSide<double>::last(f, c, 0, half);
    return fma(side.across, across ? p.x : p.y, side.ahead * p.z);
  }
  /// Signed distance to clip plane k (the first five outcodes), positive inside.
  GSNAV_HD double distance(int k, const Vec3d& p) const noexcept {
    return k == 0 ? p.z - near_plane : distance_to_side(k - 1, kMeshGuard, kMeshGuard, p);
  }
  GSNAV_HD std::uint32_t outcode(const Vec3d& p) const noexcept {
    if (!is_finite(p.x) || !is_finite(p.y) || !is_finite(p.z)) return kMeshNotFinite;
    std::uint32_t code = 0;
    for (int k = 0; k < kMeshClipPlanes; ++k) {
      if (!(distance(k, p) >= 0)) code |= 1u << k;
    }
    // These tests are linear in p. A triangle with all corners beyond one side is therefore beyond it,
    // even if it reaches behind the camera.
    for (int k = 0; k < 4; ++k) {
      if (distance_to_side(k, half_width, half_height, p) < 0) code |= kMeshLeft << k;
    }
    return code;
  }
};

/// A lattice point: pixels from the image's centre, times 2^14.
struct MeshPoint {
  std::int32_t x = 0, y = 0;
};

/// Nearest lattice coordinate.
GSNAV_HD std::int32_t snap_to_lattice(double pixels) noexcept {
  const double v = fma(pixels, static_cast<double>(1 << kMeshSubpixelBits), 0.5);
  const std::int64_t i = static_cast<std::int64_t>(v);
  return static_cast<std::int32_t>(static_cast<double>(i) > v ? i - 1 : i);
}

/// Projects a point that lies inside all clip planes.
GSNAV_HD MeshPoint project_to_lattice(const MeshCamera& c, const Vec3d& p) noexcept {
  const PinholePoint<double> at(c, p);
  return {snap_to_lattice(at.x), snap_to_lattice(at.y)};
}

/// Clips a triangle to the planes in `codes` (Sutherland-Hodgman). Returns the number of corners. The
/// crossing of an edge is computed from its inner to its outer end. Both triangles of the edge thus get
/// the same point.
GSNAV_HD int clip_triangle(const MeshCamera& camera, std::uint32_t codes,
                           Vec3d (&p)[kMeshMostCorners]) noexcept {
  int n = 3;
  for (int k = 0; k < kMeshClipPlanes; ++k) {
    if ((codes >> k & 1u) == 0) continue;
    Vec3d out[kMeshMostCorners];
    int m = 0;
    for (int i = 0; i < n; ++i) {
      const Vec3d &a = p[i], &b = p[i + 1 == n ? 0 : i + 1];
      const double da = camera.distance(k, a), db = camera.distance(k, b);
      if (da >= 0 && m < kMeshMostCorners) out[m++] = a;
      if ((da >= 0) == (db >= 0) || m == kMeshMostCorners) continue;
      const Vec3d &in = da >= 0 ? a : b, &outside = da >= 0 ? b : a;
      const double d_in = da >= 0 ? da : db, d_out = da >= 0 ? db : da;
      const double t = d_in / (d_in - d_out);
      Vec3d q{fma(outside.x - in.x, t, in.x), fma(outside.y - in.y, t, in.y),
              fma(outside.z - in.z, t, in.z)};
      q.z = max(q.z, camera.near_plane);  // rounding may have moved it in front of the near plane
      out[m++] = q;
    }
    n = m;
    for (int i = 0; i < n; ++i) p[i] = out[i];
    if (n < 3) return 0;
  }
  return n;
}

}  // namespace gsnav
