// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gsnav/kernels/gaussians.hpp"
#include "gsnav/kernels/projection.hpp"
#include "gsnav/kernels/projection_camera.hpp"

namespace gsnav {

/// Whether a Gaussian within the bounds may be visible (`Projected::visible`). Never no where one is: the
/// margins are larger than all rounding, in float too. Anything that is not finite may be.
///
/// With R the largest |w| of a footprint in standard deviations and L >= |(1, u)| for the u that the
/// Jacobian is limited to, its half-width is at most R (f sigma L / z + sqrt(h)), so "left of the image" is
/// linear in the mean once multiplied by z: f x + (cx + R sqrt(h)) z < -R f sigma L. Such a function is
/// largest at a corner of the box.
GSNAV_HD bool may_be_visible(const ProjectionCamera<double>& camera, const ChunkBounds& b) noexcept {
  const Vec3d center = (b.low + b.high) * 0.5 - camera.position;
  const Vec3d half = (b.high - b.low) * 0.5;
  const Mat3d& r = camera.rotation;
  const auto largest = [&](const Vec3d& direction) {
    return dot(direction, center) + abs(direction.x) * half.x + abs(direction.y) * half.y +
           abs(direction.z) * half.z;
  };
  // What float may add: means are rounded to 2e-6 m (offsets of up to 64 m), the camera's offset relatively.
  const double size = abs(center.x) + abs(center.y) + abs(center.z) + half.x + half.y + half.z;
  const double slack = 1e-6 * size + 1e-5;
  const double z_max = largest(r.row[2]) + slack;
  if (z_max * camera.scale * (1 + 1e-6) <= camera.near_plane) return false;
  if (camera.response != Response::ewa) return true;  // those footprints are not bounded by this

  const double z_min = max(-largest(-r.row[2]) - slack, camera.near_plane / camera.scale);
  const double s_max = log2(max(static_cast<double>(b.opacity_max), 1e-30)) - camera.log2_alpha_min;
  if (s_max < -1e-5) return false;
  const double radius = sqrt(max(s_max, 0.0)) / kWhitenScale;
  const double h = sqrt(camera.eps2d);
  const auto outside = [&](const Vec3d& axis, double f, double c, double limit, double extent) {
    const double reach = f * b.scale_max * sqrt(1 + limit * limit);
    // splat_bounds' own padding: relative, by 5e-7 of the aspect ratio more, and absolute.
    const double pad = 1.002 + 5e-7 * (reach / (z_min * h) + 1);
    const double wide = pad * radius * reach + 1e-5 * (f + abs(c) + extent) * (size + slack);
    const double fixed = pad * radius * h + 0.01;
    return largest(axis * f + r.row[2] * (c + fixed)) < -wide ||           // below the first pixel
           largest(axis * -f + r.row[2] * (extent - c + fixed)) < -wide;  // beyond the last
  };
  const double limit_u = max(abs(camera.u_min), abs(camera.u_max));
  const double limit_v = max(abs(camera.v_min), abs(camera.v_max));
  return !outside(r.row[0], camera.fx, camera.cx, limit_u, static_cast<double>(camera.width)) &&
         !outside(r.row[1], camera.fy, camera.cy, limit_v, static_cast<double>(camera.height));
}

}  // namespace gsnav
