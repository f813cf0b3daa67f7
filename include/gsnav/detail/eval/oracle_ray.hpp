// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "gsnav/detail/eval/oracle_gaussian.hpp"

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
  std::array<Double3, 3> factor;    ///< Columns: axes times standard deviations, metres.
  std::array<double, 2> dilation;   ///< Diagonal of S - Sigma in x and y; 0 in z.
  std::array<Double3, 3> adjugate;  ///< Columns of adj(S), which is symmetric.
  double u, v, z;                   ///< Ray through the mean, and its depth in metres.
  double fx, fy, cx, cy;
  double log2_opacity, reach;

  /// Projects a Gaussian. `box` contains every pixel with alpha >= 2^log2_least.
  /// @return false if it is not drawn.
  static bool make(const OracleSet& s, std::size_t row, double log2_least, RayModel& out,
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
    const Real spread = std::sqrt(Real(s.set.eps2d)) * mean.z, wide = spread / c.fx,
               high = spread / c.fy;
    out.dilation = {static_cast<double>(wide * wide), static_cast<double>(high * high)};
    const Real3 columns[5] = {m[0], m[1], m[2], {wide, 0, 0}, {0, high, 0}};
    const Real3 mean_ray{mean.x / mean.z, mean.y / mean.z, 1};
    Real area0 = 0, area = 0;  // Area of the outline, without and with the dilation.
    RealColumns adjugate{};
    for (int i = 0; i < 5; ++i) {
      for (int j = i + 1; j < 5; ++j) {
        const Real3 n = outer(columns[i], columns[j]);
        adjugate = {adjugate[0] + n.x * n, adjugate[1] + n.y * n, adjugate[2] + n.z * n};
        const Real across = inner(n, mean_ray);
        area += across * across;
        if (j < 3) area0 += across * across;
      }
    }
    for (std::size_t k = 0; k < 3; ++k) out.adjugate[k] = rounded(adjugate[k]);
    double opacity = static_cast<double>(StoredShape{s.set.gaussians.shape, row}.opacity());
    if (s.set.filter == Filter::mip) opacity *= static_cast<double>(std::sqrt(area0 / area));
    out.log2_opacity = std::log2(opacity);
    if (!(opacity > 0 && out.log2_opacity >= log2_least && out.z > 0 &&
          std::isfinite(static_cast<double>(area)))) {
      return false;
    }
    const Double3 along_z = out.row(&Double3::z);
    out.reach = reached_sigmas(out.log2_opacity, s.log2_alpha_min) * std::sqrt(inner(along_z, along_z));
    const double k = reached_sigmas(out.log2_opacity, log2_least);
    box = out.outline(c, k * k);
    return true;
  }

  double log2_alpha(double px, double py) const noexcept {
    const double du = (px - cx) / fx - u, dv = (py - cy) / fy - v;
    const Along along_ray = along(du, dv);
    if (!(along_ray.response > along_ray.turn)) return -std::numeric_limits<double>::infinity();
    const Double3 n{-dv * z, du * z, (u * dv - v * du) * z};  // mu x r.
    double q = dilation[0] * n.x * n.x + dilation[1] * n.y * n.y;
    for (const Double3& column : factor) {
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
  Double3 row(double Double3::*axis) const noexcept {
    return {factor[0].*axis, factor[1].*axis, factor[2].*axis};
  }

  /// r' adj(S) r and r' adj(S) d for the ray r = (u + du, v + dv, 1) with d = (du, dv, 0). Uses plain
  /// products: where the compiler has no fma instruction, a call of fma costs ten times more.
  struct Along {
    double response, turn;
  };
  Along along(double du, double dv) const noexcept {
    const double ru = u + du, rv = v + dv;
    const Double3 turned = ru * adjugate[0] + rv * adjugate[1] + adjugate[2];
    return {ru * turned.x + rv * turned.y + turned.z, du * turned.x + dv * turned.y};
  }

  /// Pixels inside the outline of the ellipsoid q = k2. Its extent d in u around the mean solves (d z)^2
  /// = k2 (X - 2 d Y + d^2 Z), where X, Y, Z are the covariance of (x - u z, z). It is bounded if the
  /// ellipsoid lies completely in front of the camera.
  PixelRect outline(const Camera& c, double k2) const noexcept {
    const Double3 along_z = row(&Double3::z);
    const double depth2 = inner(along_z, along_z);
    const double front = z * z - k2 * depth2;
    // Closer to the camera than this, rounding decides the extent.
    if (!(front > 1e-6 * z * z)) return {0, 0, c.width, c.height};
    const auto extent = [&](double slope, const Double3& across_axis, double dilated, double& center,
                            double& half) {
      const Double3 across = across_axis + -slope * along_z;
      const double x = inner(across, across) + dilated, y = inner(across, along_z);
      center = -k2 * y / front;
      half = std::sqrt(k2 * (k2 * y * y + front * x)) / front * (1 + 1e-8);
    };
    double center_u, half_u, center_v, half_v;
    extent(u, row(&Double3::x), dilation[0], center_u, half_u);
    extent(v, row(&Double3::y), dilation[1], center_v, half_v);
    const double mean_x = cx + fx * u, mean_y = cy + fy * v;
    // Add 1e-8 of the offset as well, because `front` is a difference.
    return pixels_within(
        c, mean_x + fx * center_u, fx * (half_u + 1e-8 * std::abs(center_u)) + 1e-12 * std::abs(mean_x),
        mean_y + fy * center_v, fy * (half_v + 1e-8 * std::abs(center_v)) + 1e-12 * std::abs(mean_y));
  }
};

}  // namespace gsnav::eval::detail
