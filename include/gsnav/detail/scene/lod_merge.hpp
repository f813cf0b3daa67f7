// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "gsnav/detail/math/angles.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Symmetric 3x3 matrix, in double.
struct Sym3 {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  Mat3d matrix() const noexcept { return {{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}}; }
  double trace() const noexcept { return xx + yy + zz; }
  /// Sum of the principal minors. For a covariance this is 3 times the determinant of its projection,
  /// averaged over directions.
  double minors() const noexcept {
    return (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
  }
  void add(const Sym3& o, double w) noexcept {
    xx += w * o.xx;
    xy += w * o.xy;
    xz += w * o.xz;
    yy += w * o.yy;
    yz += w * o.yz;
    zz += w * o.zz;
  }
  /// Adds w d d^T.
  void add_outer(const Vec3d& d, double w) noexcept {
    xx += w * d.x * d.x;
    xy += w * d.x * d.y;
    xz += w * d.x * d.z;
    yy += w * d.y * d.y;
    yz += w * d.y * d.z;
    zz += w * d.z * d.z;
  }
};

/// A Gaussian during clustering, in double.
struct LodGaussian {
  Vec3d mean{};         ///< Metres.
  Sym3 covariance{};    ///< m^2.
  double mass = 0;      ///< Opacity times area, m^2: the light that it takes, integrated over its image.
  double spread = 0;    ///< Mean squared distance from `mean` to the means of the Gaussians that it was
                        ///< merged from, weighted by mass, m^2.
  Vec3d color{};        ///< Colour of SH degree 0, for the cost.
  Vec3d normal{};       ///< Axis of the least extent, unit.
  double flatness = 0;  ///< 1 - least / middle standard deviation: how well `normal` is defined.
};

/// Area that a Gaussian covers, averaged over directions, m^2: the square root of the sum of the
/// covariance's principal minors. It is s1 s2 for a disc (its face) and sqrt(3) s^2 for a ball. For
/// Gaussians of one shape it is proportional to the projected area.
inline double lod_area(const Sym3& c) noexcept { return std::sqrt(std::max(c.minors(), 0.0)); }
/// Opacity that a Gaussian of this mass and shape has. It exceeds 1 if the area is less than the mass.
inline double lod_opacity(const LodGaussian& g) noexcept {
  return g.mass / std::max(lod_area(g.covariance), 1e-30);
}

/// Root of the mean of squared distances, weighted by mass.
struct LodDistance {
  double squares = 0, mass = 0;
  void add(double weight, double squared) noexcept {
    squares += weight * squared;
    mass += weight;
  }
  /// Metres; 0 without mass.
  double size() const noexcept { return mass > 0 ? std::sqrt(squares / mass) : 0; }
};

/// Merges two Gaussians by moment matching: the result has the sum of their masses, and the mean and
/// covariance of both together, weighted by mass. To second order in their distance it makes the same
/// image through any pixel filter.
inline LodGaussian moment_match(const LodGaussian& a, const LodGaussian& b) noexcept {
  LodGaussian m;
  m.mass = a.mass + b.mass;
  const double wa = m.mass > 0 ? a.mass / m.mass : 0.5, wb = 1 - wa;
  m.mean = a.mean * wa + b.mean * wb;
  const Vec3d da = a.mean - m.mean, db = b.mean - m.mean;
  m.covariance.add(a.covariance, wa);
  m.covariance.add(b.covariance, wb);
  m.covariance.add_outer(da, wa);
  m.covariance.add_outer(db, wb);
  m.spread = wa * (a.spread + dot(da, da)) + wb * (b.spread + dot(db, db));
  m.color = a.color * wa + b.color * wb;
  const double turned = dot(a.normal, b.normal) < 0 ? -1 : 1;
  m.normal = a.normal * wa + b.normal * (wb * turned);
  const double length = norm(m.normal);
  m.normal = length > 0 ? m.normal * (1 / length) : a.normal;
  m.flatness = (wa * a.flatness + wb * b.flatness) * length;
  return m;
}

/// Measure of how much two Gaussians cover each other, seen along `n` (unit), in units of
/// LodGaussian::mass. It is the integral of the product of their alphas over the plane perpendicular to
/// `n`, divided by 2 pi. An alpha is the opacity (mass / area) times exp(-q / 2).
inline double lod_overlap(const LodGaussian& a, const LodGaussian& b, const Vec3d& n) noexcept {
  const Vec3d any = std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  Vec3d u = cross(n, any);
  u = u * (1 / norm(u));
  const Vec3d v = cross(n, u);
  struct PlaneCovariance {
    double xx, xy, yy;
    double det() const noexcept { return xx * yy - xy * xy; }
  };
  const auto across = [&u, &v](const Sym3& s) {
    const Mat3d c = s.matrix();
    return PlaneCovariance{dot(u, c * u), dot(u, c * v), dot(v, c * v)};
  };
  const PlaneCovariance fa = across(a.covariance), fb = across(b.covariance);
  const PlaneCovariance sum{fa.xx + fb.xx, fa.xy + fb.xy, fa.yy + fb.yy};
  const double det = sum.det();
  if (!(fa.det() > 0 && fb.det() > 0 && det > 0)) return 0;
  const Vec3d d = a.mean - b.mean;
  const double x = dot(u, d), y = dot(v, d);
  const double q = (sum.yy * x * x - 2 * sum.xy * x * y + sum.xx * y * y) / det;
  const auto opacity = [](const LodGaussian& g) { return std::min(1.0, lod_opacity(g)); };
  return opacity(a) * opacity(b) * std::sqrt(fa.det() * fb.det() / det) * std::exp(-0.5 * q);
}

/// The Gaussian that stands for two. Unlike moment_match it accounts for their overlap: its mass is the
/// integral of 1 - (1 - alpha_a) (1 - alpha_b), not of alpha_a + alpha_b.
inline LodGaussian merged(const LodGaussian& a, const LodGaussian& b) noexcept {
  LodGaussian m = moment_match(a, b);
  m.mass = std::max(m.mass - lod_overlap(a, b, m.normal), std::max(a.mass, b.mass));
  return m;
}

/// Integral over space of the product of two normalised Gaussian densities, each blurred by variance /
/// 2. It equals the density of the difference of their means.
inline double density_product(const LodGaussian& a, const LodGaussian& b, double variance) noexcept {
  Sym3 s = a.covariance;
  s.add(b.covariance, 1);
  s.xx += variance;
  s.yy += variance;
  s.zz += variance;
  const double cxx = s.yy * s.zz - s.yz * s.yz, cxy = s.xz * s.yz - s.xy * s.zz,
               cxz = s.xy * s.yz - s.xz * s.yy;
  const double cyy = s.xx * s.zz - s.xz * s.xz, cyz = s.xy * s.xz - s.xx * s.yz,
               czz = s.xx * s.yy - s.xy * s.xy;
  const double det = s.xx * cxx + s.xy * cxy + s.xz * cxz;
  if (!(det > 0)) return 0;
  const Vec3d d = a.mean - b.mean;
  const double q = (d.x * (cxx * d.x + 2 * (cxy * d.y + cxz * d.z)) + d.y * (cyy * d.y + 2 * cyz * d.z) +
                    d.z * czz * d.z) /
                   det;
  return std::exp(-0.5 * q) / (kTwoPi * std::sqrt(kTwoPi * det));
}

/// Cost of merging two Gaussians: the squared L2 distance over space, in closed form, between the light
/// of the two and that of the merged one. Light is colour and coverage: mass times density, blurred so
/// that a product is blurred by `variance` (m^2). Faces that look in different directions cost more, so
/// that clusters stay thin along the view.
inline double merge_cost(const LodGaussian& a, const LodGaussian& b, double variance) noexcept {
  const LodGaussian m = moment_match(a, b);
  const auto light = [](const LodGaussian& g, const LodGaussian& h) {
    return dot(g.color, h.color) + 1;
  };
  const double aa = a.mass * a.mass * light(a, a) * density_product(a, a, variance);
  const double bb = b.mass * b.mass * light(b, b) * density_product(b, b, variance);
  const double mm = m.mass * m.mass * light(m, m) * density_product(m, m, variance);
  const double ab = a.mass * b.mass * light(a, b) * density_product(a, b, variance);
  const double am = a.mass * m.mass * light(a, m) * density_product(a, m, variance);
  const double bm = b.mass * m.mass * light(b, m) * density_product(b, m, variance);
  const double cost = std::max(aa + bb + mm + 2 * (ab - am - bm), 0.0);
  const double turn = 1 - std::abs(dot(a.normal, b.normal));
  return cost + turn * std::min(a.flatness, b.flatness) * std::min(aa, bb);
}

}  // namespace gsnav
