// SPDX-License-Identifier: Apache-2.0 Light of the default scene: sky through windows, sun, lamps, and
// reflections from walls and floor.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "flat_painter.hpp"

namespace gsnav::flat {
namespace {

const Vec3d kToSun = normalized(Vec3d{-0.42, 0.78, -0.85});

Vec3d inverse_of(const Vec3d& d) noexcept {
  const auto safe = [](double x) { return 1.0 / (abs(x) < 1e-9 ? 1e-9 : x); };
  return {safe(d.x), safe(d.y), safe(d.z)};
}

constexpr double kClear = 0.02;  // metres: rays to a window end this far in front of it

/// The boxes of a room, relative to a point, without those behind the plane through it. Rays do not go
/// there, except to a window in the plane. Such a ray ends just in front of the window.
class NearBoxes {
 public:
  NearBoxes(const Room& room, const Vec3d& point, const Vec3d& normal) {
    boxes_.reserve(room.blockers.size());
    for (const Box& b : room.blockers) {
      const Vec3d low = b.low - point, high = b.high - point;
      double before = 0;
      for (int k = 0; k < 3; ++k) before += (normal[k] > 0 ? high[k] : low[k]) * normal[k];
      if (before > -1.01 * kClear) boxes_.push_back({{low.x, high.x}, {low.y, high.y}, {low.z, high.z}});
    }
  }

  /// Distance t at which the ray t d first enters a box, at most `t`. A box around the start does not
  /// count.
  double first(const Vec3d& d, double t) const noexcept {
    const Vec3d inverse = inverse_of(d);
    // index of the plane through which the ray enters
    const int x = inverse.x < 0, y = inverse.y < 0, z = inverse.z < 0;
    for (const Slabs& b : boxes_) {
      const double in_x = b.x[x] * inverse.x, in_y = b.y[y] * inverse.y, in_z = b.z[z] * inverse.z;
      const double in_xy = in_x > in_y ? in_x : in_y, in = in_xy > in_z ? in_xy : in_z;
      if (!(in > 1e-4 && in < t)) continue;
      if (in < b.x[1 - x] * inverse.x && in < b.y[1 - y] * inverse.y && in < b.z[1 - z] * inverse.z)
        t = in;
    }
    return t;
  }
  /// Whether a box lies between the point and the end of `d`.
  bool between(const Vec3d& d) const noexcept { return first(d, 0.999) < 0.999; }

 private:
  struct Slabs {
    double x[2], y[2], z[2];  ///< Low and high.
  };
  std::vector<Slabs> boxes_;
};

/// Distance at which a ray that starts inside leaves the box.
double leave(const Box& b, const Vec3d& o, const Vec3d& d) noexcept {
  const Vec3d inverse = inverse_of(d);
  double t1 = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    t1 = std::min(t1, std::max((b.low[k] - o[k]) * inverse[k], (b.high[k] - o[k]) * inverse[k]));
  }
  return std::max(t1, 0.0);
}

}  // namespace

Vec3d Painter::light_at(const Room& room, const Vec3d& point, const Vec3d& n) const {
  const Vec3d p = point + n * 0.015;

  // Ambient light: near surfaces darken it, low ones give it the floor's colour.
  const Vec3d u = normalized(cross(abs(n.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, n)),
              v = cross(n, u);
  const NearBoxes boxes(room, p, n);
  Vec3d ambient{};
  for (const Vec3d& h : hemisphere_) {
    const Vec3d d = u * h.x + v * h.y + n * h.z;
    const double t = boxes.first(d, leave(room.inside, p, d));
    const double open = t * t / (t * t + 0.16);
    const double down = std::clamp(-d.y * 1.5, 0.0, 1.0);
    ambient += lerp(Vec3d{1.0, 0.98, 0.95}, room.bounce, down) * (0.25 + 0.75 * open);
  }
  Vec3d sum = ambient * (0.60 / static_cast<double>(hemisphere_.size()));

  for (const Window& w : room.windows) {
    const Vec3d facing = cross(w.u, w.v);
    const double area = norm(facing);
    constexpr int kAcross = 4, kUp = 4;
    double direct = 0;
    for (int k = 0; k < kAcross * kUp; ++k) {
      const Vec3d q =
          w.corner + w.u * ((k % kAcross + 0.5) / kAcross) + w.v * ((k / kAcross + 0.5) / kUp);
      const Vec3d d = q - p;
      const double r2 = dot(d, d), c0 = dot(d, n), c1 = -dot(d, facing) / area;
      if (c0 <= 0 || c1 <= 0 || boxes.between(q + facing * (kClear / area) - p)) continue;
      direct += c0 * c1 / (r2 * (r2 + 0.05));
    }
    sum += Vec3d{0.93, 0.98, 1.06} * (5.2 * direct * area / (std::numbers::pi * kAcross * kUp));
  }
  for (const Lamp& l : room.lamps) {
    double direct = 0;
    for (int k = 0; k < 4; ++k) {
      const Vec3d q = l.position + Vec3d{(k & 1) != 0 ? 0.08 : -0.08, 0, (k & 2) != 0 ? 0.08 : -0.08};
      const Vec3d d = q - p;
      const double r2 = dot(d, d), c = dot(d, n) / std::sqrt(r2);
      if (c > 0 && !boxes.between(q - p)) direct += c / (r2 + 0.12);
    }
    sum += Vec3d{1.0, 0.80, 0.55} * (0.25 * 0.30 * l.power * direct);
  }
  return sum;
}

bool Painter::sun_at(const Room& room, const Vec3d& point, const Vec3d& n) const {
  if (dot(n, kToSun) < 0.05) return false;
  const Vec3d p = point + n * 0.01;
  for (const Window& w : room.windows) {
    const Vec3d facing = cross(w.u, w.v);
    const double rate = dot(kToSun, facing);
    if (rate >= 0) continue;  // the sun is behind this wall
    const double t = dot(w.corner - p, facing) / rate;
    if (t <= 0) continue;
    const Vec3d q = p + kToSun * t - w.corner;
    const double a = dot(q, w.u) / dot(w.u, w.u), b = dot(q, w.v) / dot(w.v, w.v);
    // Two bars cross the pane.
    if (a < 0.03 || a > 0.97 || b < 0.03 || b > 0.97 || abs(a - 0.5) < 0.025 || abs(b - 0.62) < 0.02)
      continue;
    return !NearBoxes(room, p, n).between(p + kToSun * t - p);
  }
  return false;
}

}  // namespace gsnav::flat
