// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/math/mat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// What a piece of the body's surface is made of.
enum class BodyPart : std::uint8_t { skin, hair, top, trousers, shoes };

/// A limb's piece: elliptical sections along the segment a b, rounded at both ends. Radii are across,
/// along and through the piece, in its own axes.
struct Lobe {
  Vec3d a{}, b{};                      ///< metres, bind pose, root frame
  Vec3d radii_a{}, radii_b{};          ///< at a and at b
  Mat3d axes = Mat3d::identity();      ///< rows: across, along, through
  double blend = 0.02;                 ///< metres over which it grows together with what is there already
  std::uint16_t joint = 0;             ///< what moves it
  BodyPart part = BodyPart::skin;

  /// Signed distance of p, to first order near the surface; metres, negative inside.
  double distance(const Vec3d& p) const noexcept {
    const Vec3d ab = b - a, ap = p - a;
    const double length2 = dot(ab, ab);
    const double t = length2 > 0 ? clamp(dot(ap, ab) / length2, 0.0, 1.0) : 0.0;
    const Vec3d r = lerp(radii_a, radii_b, t), v = axes * (ap - ab * t);
    const Vec3d q{v.x / r.x, v.y / r.y, v.z / r.z};
    const double k0 = norm(q), k1 = norm(Vec3d{q.x / r.x, q.y / r.y, q.z / r.z});
    return k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -min(min(r.x, r.y), r.z);
  }

  /// Radius of a ball around the middle of the segment that holds the lobe.
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

/// A body as the smooth union of its lobes, in their order, cut off flat at the ground. The union is the
/// quadratic polynomial smooth minimum (Quilez, "smooth minimum").
struct BodyShape {
  std::vector<Lobe> lobes;

  /// Indices of the lobes that can matter within `margin` metres of lobe `i`.
  std::vector<std::size_t> neighbours(std::size_t i, double margin) const {
    std::vector<std::size_t> out;
    for (std::size_t k = 0; k < lobes.size(); ++k) {
      if (norm(lobes[k].middle() - lobes[i].middle()) < lobes[k].reach() + lobes[i].reach() + margin) {
        out.push_back(k);
      }
    }
    return out;
  }

  /// Signed distance to the union of the lobes named by `among`.
  double distance(const Vec3d& p, const std::vector<std::size_t>& among) const noexcept {
    double d = 1e3;
    for (const std::size_t k : among) {
      const double e = lobes[k].distance(p), blend = lobes[k].blend;
      const double h = max(blend - abs(d - e), 0.0) / blend;
      d = min(d, e) - 0.25 * h * h * blend;
    }
    return max(d, -p.y);
  }

  /// Outward gradient of `distance` by central differences.
  Vec3d gradient(const Vec3d& p, const std::vector<std::size_t>& among) const noexcept {
    constexpr double h = 2e-4;
    Vec3d g;
    for (int k = 0; k < 3; ++k) {
      Vec3d lo = p, hi = p;
      lo[k] -= h;
      hi[k] += h;
      g[k] = (distance(hi, among) - distance(lo, among)) / (2 * h);
    }
    return g;
  }

  /// Moves p onto the surface along the gradient; false where it does not get there.
  bool project(Vec3d& p, const std::vector<std::size_t>& among) const noexcept {
    for (int i = 0; i < 8; ++i) {
      const double d = distance(p, among);
      if (abs(d) < 1e-4) return true;
      const Vec3d g = gradient(p, among);
      const double g2 = dot(g, g);
      if (!(g2 > 1e-3)) return false;
      p -= g * (clamp(d / g2, -0.02, 0.02));
    }
    return abs(distance(p, among)) < 5e-4;
  }
};

}  // namespace gsnav
