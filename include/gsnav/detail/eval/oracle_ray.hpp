// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "gsnav/detail/eval/oracle_gaussian.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav::eval::detail {

/// A Gaussian by its largest response along each pixel's ray r = (u, v, 1), in camera axes:
///
///     q = (mu x r)' S (mu x r) / (r' adj(S) r),   S = Sigma + h diag((z/fx)^2, (z/fy)^2, 0)
///
/// The depth of that response is z - z (r' adj(S) d) / (r' adj(S) r), with d = r - mu / z. S contains
/// the dilation of the contract, scaled to the depth of the mean. adj(S) is the sum of n n' over the
/// cross products n of two columns of S's factor (Cauchy-Binet). Nothing cancels and nothing is
/// inverted. A ray does not see a Gaussian whose largest response lies behind the camera. There is no
/// Jacobian and hence no limit on it.
struct RayModel {
  std::array<Vec3d, 3> factor;  ///< Columns: axes times standard deviations, metres.
  Vec3d dilation;               ///< Diagonal of S - Sigma.
  Mat3d adjugate;               ///< adj(S).
  double u, v, z;               ///< Ray through the mean, and its depth in metres.
  double fx, fy, cx, cy;
  double log2_opacity, reach;

  /// Projects a Gaussian. `box` contains every pixel with alpha >= 2^log2_cut.
  /// @return false if it is not drawn.
  static bool make(const OracleSet& s, std::size_t row, double log2_cut, RayModel& out,
                   PixelRect& box) noexcept {
    const Camera& c = s.camera;
    const Real3 mean = s.center(row);
    const RealColumns m = s.factor(row);
    if (!s.in_front(mean, m)) return false;
    for (std::size_t k = 0; k < 3; ++k) out.factor[k] = rounded(m[k]);
    out.z = static_cast<double>(mean.z);
    out.u = static_cast<double>(mean.x / mean.z);
    out.v = static_cast<double>(mean.y / mean.z);
    out.fx = c.fx;
    out.fy = c.fy;
    out.cx = c.cx;
    out.cy = c.cy;
    const double spread = std::sqrt(static_cast<double>(s.set.eps2d));
    const double wide = spread * out.z / c.fx, high = spread * out.z / c.fy;
    out.dilation = {wide * wide, high * high, 0};
    const Vec3d columns[5] = {out.factor[0], out.factor[1], out.factor[2], {wide, 0, 0}, {0, high, 0}};
    const Vec3d mean_ray{out.u, out.v, 1};
    double area0 = 0, area = 0;  // Area of the outline, without and with the dilation.
    out.adjugate = {};
    for (int i = 0; i < 5; ++i) {
      for (int j = i + 1; j < 5; ++j) {
        const Vec3d n = cross(columns[i], columns[j]);
        for (int k = 0; k < 3; ++k) out.adjugate.row[k] = out.adjugate.row[k] + n * n[k];
        const double across = dot(n, mean_ray);
        area += across * across;
        if (j < 3) area0 += across * across;
      }
    }
    double opacity = static_cast<double>(opacity_of(s.set.gaussians.shape, row));
    if (s.set.filter == Filter::mip) opacity *= std::sqrt(area0 / area);
    out.log2_opacity = std::log2(opacity);
    if (!(opacity > 0 && out.log2_opacity >= log2_cut && out.z > 0 && std::isfinite(area))) return false;
    out.reach = reached_sigmas(out.log2_opacity, s.log2_alpha_min) * norm(out.row(2));
    const double k = reached_sigmas(out.log2_opacity, log2_cut);
    box = out.outline(c, k * k);
    return true;
  }

  double log2_alpha(double px, double py) const noexcept {
    const double du = (px - cx) / fx - u, dv = (py - cy) / fy - v;
    const Along along_ray = along(du, dv);
    if (!(along_ray.response > along_ray.turn)) return -std::numeric_limits<double>::infinity();
    const Vec3d n{-dv * z, du * z, (u * dv - v * du) * z};  // mu x r.
    double q = dilation.x * n.x * n.x + dilation.y * n.y * n.y;
    for (const Vec3d& column : factor) {
      const double across = column.x * n.x + column.y * n.y + column.z * n.z;
      q += across * across;
    }
    return log2_opacity - q / along_ray.response / (2 * std::log(2.0));
  }

  /// Depth of the largest response. As in the contract, the offset from the centre is limited to a
  /// number of standard deviations along the view axis.
  double depth(double px, double py) const noexcept {
    const double du = (px - cx) / fx - u, dv = (py - cy) / fy - v;
    const Along a = along(du, dv);
    return z + std::clamp(-z * a.turn / a.response, -reach, reach);
  }

 private:
  Vec3d row(int axis) const noexcept { return {factor[0][axis], factor[1][axis], factor[2][axis]}; }

  /// r' adj(S) r and r' adj(S) d for the ray r = (u + du, v + dv, 1) with d = (du, dv, 0). Uses plain
  /// products: where the compiler has no fma instruction, a call of fma costs ten times more.
  struct Along {
    double response, turn;
  };
  Along along(double du, double dv) const noexcept {
    const double ru = u + du, rv = v + dv;
    const Mat3d& a = adjugate;
    const double x = a(0, 0) * ru + a(0, 1) * rv + a(0, 2), y = a(0, 1) * ru + a(1, 1) * rv + a(1, 2);
    return {ru * x + rv * y + (a(0, 2) * ru + a(1, 2) * rv + a(2, 2)), du * x + dv * y};
  }

  /// Pixels inside the outline of the ellipsoid q = k2. Its extent d in u around the mean solves (d z)^2
  /// = k2 (X - 2 d Y + d^2 Z), where X, Y, Z are the covariance of (x - u z, z). It is bounded if the
  /// ellipsoid lies completely in front of the camera.
  PixelRect outline(const Camera& c, double k2) const noexcept {
    const Vec3d along_z = row(2);
    const double depth2 = dot(along_z, along_z);
    const double front = z * z - k2 * depth2;
    // Closer to the camera than this, rounding decides the extent.
    if (!(front > 1e-6 * z * z)) return {0, 0, c.width, c.height};
    const auto extent = [&](double slope, int axis, double& center, double& half) {
      const Vec3d across = row(axis) - along_z * slope;
      const double x = dot(across, across) + dilation[axis], y = dot(across, along_z);
      center = -k2 * y / front;
      half = std::sqrt(k2 * (k2 * y * y + front * x)) / front * (1 + 1e-8);
    };
    double center_u, half_u, center_v, half_v;
    extent(u, 0, center_u, half_u);
    extent(v, 1, center_v, half_v);
    const double mean_x = cx + fx * u, mean_y = cy + fy * v;
    // Add 1e-8 of the offset as well, because `front` is a difference.
    return pixels_within(
        c, mean_x + fx * center_u, fx * (half_u + 1e-8 * std::abs(center_u)) + 1e-12 * std::abs(mean_x),
        mean_y + fy * center_v, fy * (half_v + 1e-8 * std::abs(center_v)) + 1e-12 * std::abs(mean_y));
  }
};

}  // namespace gsnav::eval::detail
