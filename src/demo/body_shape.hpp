// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/mat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Material of a piece of the body's surface.
enum class BodyPart : std::uint8_t { skin, hair, top, trousers, shoes };

/// A piece of a limb: elliptical sections along the segment a b, rounded at both ends. Radii are across,
/// along and through the piece, in its own axes.
struct Lobe {
  Vec3d a{}, b{};                  ///< metres, bind pose, root frame
  Vec3d radii_a{}, radii_b{};      ///< At a and at b.
  Mat3d axes = Mat3d::identity();  ///< Rows: across, along, through.
  double blend = 0.02;             ///< Metres over which it merges with the lobes before it.
  std::uint16_t joint = 0;         ///< The joint that moves it.
  BodyPart part = BodyPart::skin;

  /// Signed distance of p in metres, negative inside; exact to first order near the surface. If `normal`
  /// is not null, it gets the outward unit normal there.
  double distance(const Vec3d& p, Vec3d* normal = nullptr) const noexcept {
    const Vec3d ab = b - a, ap = p - a;
    const double t = segment_fraction(product(ap, ab), product(ab, ab));
    const Vec3d r = radii_a + (radii_b - radii_a) * t, off = ap - ab * t;
    const Vec3d v{product(axes.row[0], off), product(axes.row[1], off), product(axes.row[2], off)};
    const Vec3d q{v.x / r.x, v.y / r.y, v.z / r.z}, g{q.x / r.x, q.y / r.y, q.z / r.z};
    const double k0 = sqrt(product(q, q)), k1 = sqrt(product(g, g));
    if (!(k1 > 1e-9)) {
      if (normal != nullptr) *normal = {0, 1, 0};
      return -min(min(r.x, r.y), r.z);
    }
    if (normal != nullptr)
      *normal = (axes.row[0] * g.x + axes.row[1] * g.y + axes.row[2] * g.z) * (1 / k1);
    return k0 * (k0 - 1) / k1;
  }

  /// a . b without fma, which is a library call unless the compiler may assume the instruction.
  static double product(const Vec3d& x, const Vec3d& y) noexcept {
    return x.x * y.x + x.y * y.y + x.z * y.z;
  }

  /// Radius of a ball around the middle of the segment that contains the lobe.
  double reach() const noexcept {
    double r = 0;
    for (int k = 0; k < 3; ++k) r = max(r, max(radii_a[k], radii_b[k]));
    return 0.5 * norm(b - a) + r;
  }
  Vec3d middle() const noexcept { return (a + b) * 0.5; }
  double area() const noexcept {
    const double r = 0.25 * (radii_a.x + radii_a.z + radii_b.x + radii_b.z);
    return 6.3 * r * (norm(b - a) + radii_a.y + radii_b.y);
  }
};

/// A ball that contains a lobe.
struct LobeBall {
  Vec3d center{};
  double radius = 0;
};

/// A body: the smooth union of its lobes in order, cut off flat at the ground. The union is the
/// quadratic polynomial smooth minimum (Quilez, "smooth minimum").
struct BodyShape {
  std::vector<Lobe> lobes;
  std::vector<LobeBall> balls;  ///< One for each lobe, made by `enclose`.

  /// Computes `balls`. Call it after the lobes are complete.
  void enclose() {
    balls.clear();
    for (const Lobe& l : lobes) balls.push_back({l.middle(), l.reach()});
  }

  /// Indices of the lobes that can have an effect within `margin` metres of lobe `i`.
  std::vector<std::size_t> neighbours(std::size_t i, double margin) const {
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < lobes.size(); ++k) {
      if (norm(balls[k].center - balls[i].center) < balls[k].radius + balls[i].radius + margin) {
        out.push_back(k);
      }
    }
    return out;
  }

  /// Signed distance of p to the union of the lobes in `among`. If `gradient` is not null, it gets the
  /// outward direction, of about unit length.
  double distance(const Vec3d& p, const std::vector<std::size_t>& among,
                  Vec3d* gradient = nullptr) const noexcept {
    double d = 1e3;
    Vec3d sum{0, 1, 0}, normal;
    for (const std::size_t k : among) {
      const double blend = lobes[k].blend;
      // Skip lobes too far away to change anything.
      const Vec3d apart = p - balls[k].center;
      const double limit = balls[k].radius + blend + max(d, 0.0);
      if (Lobe::product(apart, apart) > limit * limit) continue;
      const double e = lobes[k].distance(p, gradient != nullptr ? &normal : nullptr);
      const double h = max(blend - abs(d - e), 0.0) / blend;
      const double other = e < d ? 1 - 0.5 * h : 0.5 * h;
      if (gradient != nullptr) sum = sum + (normal - sum) * other;
      d = min(d, e) - 0.25 * h * h * blend;
    }
    if (-p.y > d) {
      d = -p.y;
      sum = {0, -1, 0};
    }
    if (gradient != nullptr) *gradient = sum;
    return d;
  }

  /// Moves p onto the surface along the gradient, which is left in `gradient`. Returns false if it does
  /// not reach the surface.
  bool project(Vec3d& p, const std::vector<std::size_t>& among, Vec3d& gradient) const noexcept {
    for (int i = 0; i < 10; ++i) {
      const double d = distance(p, among, &gradient);
      if (abs(d) < 1e-4) return true;
      const double g2 = Lobe::product(gradient, gradient);
      if (d < -0.03 || !(g2 > 1e-2)) return false;  // deep within another lobe
      p -= gradient * clamp(d / g2, -0.02, 0.02);
    }
    return false;
  }
};

}  // namespace gsnav
