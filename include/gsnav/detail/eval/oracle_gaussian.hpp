// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "gsnav/detail/eval/oracle_config.hpp"
#include "gsnav/detail/eval/oracle_rows.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/render/config.hpp"

// A row of a set in long double and metres. Nothing is shared with the kernels: every formula here is
// written independently, from the contract.

namespace gsnav::eval::detail {

template <class T>
T inner(const Triple<T>& a, const Triple<T>& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Real3 outer(const Real3& a, const Real3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Double3 rounded(const Real3& a) noexcept {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

/// Columns of a 3x3 matrix.
using RealColumns = std::array<Real3, 3>;

inline Real3 operator*(const RealColumns& m, const Real3& v) noexcept {
  return v.x * m[0] + v.y * m[1] + v.z * m[2];
}

/// Columns of the rotation matrix of a quaternion. The quaternion need not be normalized, but must not
/// be 0.
inline RealColumns rotation_columns(Real w, Real x, Real y, Real z) noexcept {
  const Real s = 2 / (w * w + x * x + y * y + z * z);
  return {{{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)},
           {s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)},
           {s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)}}};
}

/// Real spherical harmonic of degree l (0 to 3) and order m (-l to l) with the Condon-Shortley phase, at
/// the unit vector d. Uses the recurrence of the associated Legendre polynomials.
inline Real spherical_harmonic(int l, int m, const Real3& d) noexcept {
  const Real pi = 3.14159265358979323846264338327950288L;
  const int order = m < 0 ? -m : m;
  // Starts with P_order^order / sin^order. The recurrence then raises the degree.
  Real below = 0, legendre = 1, cosine = 1, sine = 0, ratio = 1;
  for (int i = 1; i <= order; ++i) {
    legendre *= -(2 * i - 1);
    const Real c = cosine * d.x - sine * d.y;
    sine = cosine * d.y + sine * d.x;
    cosine = c;
  }
  for (int i = order + 1; i <= l; ++i) {
    const Real next = ((2 * i - 1) * d.z * legendre - (i + order - 1) * below) / (i - order);
    below = legendre;
    legendre = next;
  }
  for (int i = l - order + 1; i <= l + order; ++i) ratio *= i;
  const Real norm = std::sqrt((2 * l + 1) / (4 * pi * ratio));
  if (m == 0) return norm * legendre;
  return std::sqrt(Real(2)) * norm * legendre * (m < 0 ? sine : cosine);
}

/// Converts a colour value to the space in which the frame is blended (IEC 61966-2-1).
inline Real in_blend_space(Real value, ColorSpace from, ColorSpace to) noexcept {
  if (from == to) return value;
  value = std::max(value, Real(0));
  if (to == ColorSpace::linear) {
    return value <= 0.04045L ? value / 12.92L : std::pow((value + 0.055L) / 1.055L, 2.4L);
  }
  return value <= 0.0031308L ? value * 12.92L : 1.055L * std::pow(value, 1 / 2.4L) - 0.055L;
}

/// One set in the frame of a camera.
struct OracleSet {
  GaussianSet set;
  Camera camera;
  SortOrder sort_order;
  std::size_t first_row = 0;        ///< Index of its first row among the rows of all sets.
  RealColumns camera_from_asset{};  ///< Includes the scale.
  Real3 origin_in_camera{};         ///< Origin of the asset in camera axes, metres.
  Real3 eye{};                      ///< Camera position in the asset's frame.
  double log2_alpha_min;

  OracleSet(const GaussianSet& s, const Camera& c, const RenderConfig& rules, std::size_t first)
      : set(s),
        camera(c),
        sort_order(rules.sort_order),
        first_row(first),
        log2_alpha_min(std::log2(rules.quality.alpha_min)) {
    const Similarity& a = s.world_from_asset;
    const auto view = [&c](const Real3& v) {
      const auto row = [&](int r) {
        return c.viewmat.linear(r, 0) * v.x + c.viewmat.linear(r, 1) * v.y +
               c.viewmat.linear(r, 2) * v.z;
      };
      return Real3{row(0), row(1), row(2)};
    };
    const RealColumns turn = rotation_columns(a.rotation.w, a.rotation.x, a.rotation.y, a.rotation.z);
    for (std::size_t k = 0; k < 3; ++k) camera_from_asset[k] = Real(a.scale) * view(turn[k]);
    const Vec3d& t = c.viewmat.translation;
    origin_in_camera = view({a.translation.x, a.translation.y, a.translation.z}) + Real3{t.x, t.y, t.z};
    // The position where all camera axes are 0. The columns of camera_from_asset are orthogonal and of
    // equal length.
    const auto along = [this](const Real3& column) {
      return -inner(column, origin_in_camera) / inner(column, column);
    };
    eye = {along(camera_from_asset[0]), along(camera_from_asset[1]), along(camera_from_asset[2])};
  }
  /// Stable id: position in the order in which rows were read, over all sets. It does not depend on how
  /// rows are stored.
  std::uint32_t id(std::size_t row) const noexcept {
    const View<const std::uint32_t> rows = set.gaussians.row_ids;
    return static_cast<std::uint32_t>(first_row + (rows.empty() ? row : rows[row]));
  }
  /// Mean in the asset's frame.
  Real3 place(std::size_t row) const noexcept {
    const GaussianRows& gs = set.gaussians;
    Real3 p = StoredShape{gs.shape, row}.mean();
    if (!gs.origins.empty()) {
      const Vec3d& from = gs.origins[gs.shape.origin_ids.empty() ? 0 : gs.shape.origin_ids[row]];
      p = p + Real3{from.x, from.y, from.z};
    }
    return p;
  }
  /// Mean in camera axes, metres.
  Real3 center(std::size_t row) const noexcept {
    return camera_from_asset * place(row) + origin_in_camera;
  }

  /// Columns of M in camera axes, metres, with Sigma = M M^T.
  RealColumns factor(std::size_t row) const noexcept {
    const StoredShape stored{set.gaussians.shape, row};
    RealColumns m;
    if (stored.has_columns()) {
      m = stored.columns();
    } else {
      const std::array<Real, 4> q = stored.quat();
      const std::array<Real, 3> s = stored.scales();
      m = rotation_columns(q[0], q[1], q[2], q[3]);
      for (std::size_t k = 0; k < 3; ++k) m[k] = s[k] * m[k];
    }
    for (Real3& column : m) column = camera_from_asset * column;
    return m;
  }

  /// Quantity that the contract sorts by, metres, not rounded.
  Real key(std::size_t row) const noexcept {
    const Real3 at = center(row);
    return sort_order == SortOrder::z_depth ? at.z : std::sqrt(inner(at, at));
  }

  /// Returns true if the Gaussian passes the contract's near rules.
  bool in_front(const Real3& center, const RealColumns& m) const noexcept {
    const Real sigma_z = std::sqrt(m[0].z * m[0].z + m[1].z * m[1].z + m[2].z * m[2].z);
    return static_cast<float>(center.z) > static_cast<float>(camera.near_plane) &&
           (!(camera.near_sigma > 0) || center.z > camera.near_sigma * sigma_z);
  }

  /// Colour towards the camera, with SH up to `degree`, in `blend_space`.
  Double3 color(std::size_t row, int degree, ColorSpace blend_space) const noexcept {
    const ColorRows& gs = set.gaussians.color;
    Real3 d = place(row) + Real(-1) * eye;
    const Real length = std::sqrt(inner(d, d));
    d = length > 1e-12L ? (1 / length) * d : Real3{0, 0, 1};
    if (!gs.rotations.empty()) {
      const Planes<const float, 4>& r = gs.rotations;
      const RealColumns turned = rotation_columns(r[0][row], r[1][row], r[2][row], r[3][row]);
      d = {inner(turned[0], d), inner(turned[1], d), inner(turned[2], d)};
    }
    Real3 sum{0.5L, 0.5L, 0.5L};
    for (int l = 0; l <= degree; ++l) {
      for (int m = -l; m <= l; ++m)
        sum = sum + spherical_harmonic(l, m, d) * stored_coefficient(gs, row, l * l + l + m);
    }
    const auto blended = [&](Real v) {
      return static_cast<double>(in_blend_space(std::max(v, Real(0)), set.color_space, blend_space));
    };
    return {blended(sum.x), blended(sum.y), blended(sum.z)};
  }
};

/// Integer that a renderer with `bits` key bits sorts by: all bits of the float32 key, or fewer, counted
/// from the near plane (RenderConfig::key_bits).
inline std::uint32_t sorted_code(float key, int bits, float near_plane) noexcept {
  const std::uint32_t whole = std::bit_cast<std::uint32_t>(key);
  if (bits >= 32) return whole;
  const std::uint32_t base = std::bit_cast<std::uint32_t>(near_plane);
  const std::uint32_t steps = whole < base ? 0 : (whole - base) >> std::max(27 - bits, 0);
  return std::min(steps, (std::uint32_t{1} << bits) - 1);
}

/// Pixels of the image whose centres lie within a half size of the given centre.
inline PixelRect pixels_within(const Camera& camera, double center_x, double half_x, double center_y,
                               double half_y) noexcept {
  const auto first = [](double low, int size) {
    return static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, static_cast<double>(size)));
  };
  const auto end = [](double high, int size) {
    return static_cast<int>(std::clamp(std::floor(high - 0.5) + 1, 0.0, static_cast<double>(size)));
  };
  return {first(center_x - half_x, camera.width), first(center_y - half_y, camera.height),
          end(center_x + half_x, camera.width), end(center_y + half_y, camera.height)};
}

/// Distance from the mean, in standard deviations, at which alpha falls to 2^log2_edge.
inline double reached_sigmas(double log2_opacity, double log2_edge) noexcept {
  return std::sqrt(std::max(2 * std::log(2.0) * (log2_opacity - log2_edge), 0.0));
}

/// A Gaussian by the contract (EWA): linearized at its mean, dilated, and evaluated in the image plane.
struct EwaModel {
  double mean_x, mean_y;  ///< Projected mean, pixels.
  double per_variance_x, slope,
      per_rest;  ///< 1 / var(x), cov / var(x), and 1 / (var(y) - cov^2 / var(x)), in pixels.
  double log2_opacity;
  Double3 mean_ray;              ///< Ray through the mean. The third component is 1.
  std::array<Double3, 3> areas;  ///< Cross products m1 x m2, m2 x m0, m0 x m1 of the columns of M,
                                 ///< divided by the length of the longest of the three.
  double fx, fy, z, reach;       ///< Focal lengths in pixels; depth of the mean and limit of the depth
                                 ///< offset in metres.

  /// Projects a Gaussian. `box` contains every pixel with alpha >= 2^log2_least.
  /// @return false if it is not drawn.
  static bool make(const OracleSet& s, std::size_t row, double log2_least, EwaModel& out,
                   PixelRect& box) noexcept {
    const Camera& c = s.camera;
    const Real3 mean = s.center(row);
    const RealColumns m = s.factor(row);
    if (!s.in_front(mean, m)) return false;
    const Real u = mean.x / mean.z, v = mean.y / mean.z;

    // Rows of J M, where J is the Jacobian with its limits.
    const Real side = 0.3L * c.width / (2 * c.fx), top = 0.3L * c.height / (2 * c.fy);
    const Real uj = std::clamp<Real>(u, -(c.cx / c.fx + side), (c.width - c.cx) / c.fx + side);
    const Real vj = std::clamp<Real>(v, -(c.cy / c.fy + top), (c.height - c.cy) / c.fy + top);
    const Real3 jx{c.fx / mean.z, 0, -c.fx * uj / mean.z}, jy{0, c.fy / mean.z, -c.fy * vj / mean.z};
    const Real3 lx{inner(jx, m[0]), inner(jx, m[1]), inner(jx, m[2])};
    const Real3 ly{inner(jy, m[0]), inner(jy, m[1]), inner(jy, m[2])};
    const Real a0 = inner(lx, lx), c0 = inner(ly, ly);
    // Lagrange's identity turns a0 c0 - b0^2 into a sum of squares, which does not cancel.
    const Real3 crossed = outer(lx, ly);
    const auto dilated = [&](Real h) { return inner(crossed, crossed) + h * (a0 + c0) + h * h; };
    const Real h = s.set.eps2d, det = dilated(h);

    Real opacity = StoredShape{s.set.gaussians.shape, row}.opacity();
    if (s.set.filter == Filter::mip) opacity *= std::sqrt(dilated(s.set.base_eps2d) / det);
    out.mean_x = static_cast<double>(c.fx * u + c.cx);
    out.mean_y = static_cast<double>(c.fy * v + c.cy);
    const Real variance_x = a0 + h, variance_y = c0 + h;
    out.per_variance_x = static_cast<double>(1 / variance_x);
    out.slope = static_cast<double>(inner(lx, ly) / variance_x);
    out.per_rest = static_cast<double>(variance_x / det);
    out.log2_opacity = static_cast<double>(std::log2(opacity));
    // Gaussians whose values overflow float32 are not drawn by any backend.
    constexpr double huge = 3e38;
    if (!(opacity > 0 && out.log2_opacity >= log2_least && det <= huge && variance_x <= huge &&
          variance_y <= huge && std::abs(out.mean_x) <= huge && std::abs(out.mean_y) <= huge)) {
      return false;
    }

    const RealColumns areas{outer(m[1], m[2]), outer(m[2], m[0]), outer(m[0], m[1])};
    Real longest = 0;
    for (const Real3& n : areas) longest = std::max(longest, std::sqrt(inner(n, n)));
    for (std::size_t k = 0; k < 3; ++k)
      out.areas[k] = longest > 0 ? rounded((1 / longest) * areas[k]) : Double3{};
    out.mean_ray = {static_cast<double>(u), static_cast<double>(v), 1};
    out.fx = c.fx;
    out.fy = c.fy;
    out.z = static_cast<double>(mean.z);
    const Real sigma_z = std::sqrt(m[0].z * m[0].z + m[1].z * m[1].z + m[2].z * m[2].z);
    out.reach = reached_sigmas(out.log2_opacity, s.log2_alpha_min) * static_cast<double>(sigma_z);

    // The ellipse q = k^2 touches x = mean +- k sqrt(variance). The margin is a hundred times the
    // rounding error.
    const double k = reached_sigmas(out.log2_opacity, log2_least) * (1 + 1e-9);
    const auto half = [k](Real variance, double at) {
      return k * std::sqrt(static_cast<double>(variance)) + 1e-12 * std::abs(at);
    };
    box = pixels_within(c, out.mean_x, half(variance_x, out.mean_x), out.mean_y,
                        half(variance_y, out.mean_y));
    return true;
  }
  /// log2 of alpha before max_alpha. q is written as a square in x plus a square of the rest of y after
  /// regression on x.
  double log2_alpha(double px, double py) const noexcept {
    const double dx = px - mean_x, dy = py - mean_y;
    const double rest = dy - slope * dx;
    const double q = dx * dx * per_variance_x + rest * rest * per_rest;
    return log2_opacity - q * (0.5 / std::log(2.0));
  }
  /// Depth of the largest response along the ray r, for the ellipsoid without dilation: z (r' adj(Sigma)
  /// m) / (r' adj(Sigma) r). m is the ray through the mean, and adj(Sigma) is the sum of n n' over
  /// `areas`.
  double depth(double px, double py) const noexcept {
    const double du = (px - mean_x) / fx, dv = (py - mean_y) / fy;
    double along = 0, turned = 0;
    for (const Double3& n : areas) {
      const double change = n.x * du + n.y * dv;
      const double response = n.x * mean_ray.x + n.y * mean_ray.y + n.z + change;
      along += response * response;
      turned += response * change;
    }
    if (!(along > 0)) return z;
    return z - std::clamp(z * turned / along, -reach, reach);
  }
};

}  // namespace gsnav::eval::detail
