// SPDX-License-Identifier: Apache-2.0
#include "flat_painter.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/math/easing.hpp"

namespace gsnav::flat {
Vec3d srgb(unsigned hex) noexcept {
  const auto channel = [hex](int shift) {
    return linear_from_srgb_byte(static_cast<std::uint8_t>((hex >> shift) & 255u));
  };
  return {channel(16), channel(8), channel(0)};
}

double hash01(int a, int b, int c) noexcept {
  std::uint32_t h = static_cast<std::uint32_t>(a) * 0x8da6b343u ^
                    static_cast<std::uint32_t>(b) * 0xd8163841u ^
                    static_cast<std::uint32_t>(c) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return static_cast<double>((h ^ (h >> 16)) >> 8) * 0x1.0p-24;
}

double noise(double x, double y, int seed) noexcept {
  const double fx = std::floor(x), fy = std::floor(y);
  const int i = static_cast<int>(fx), j = static_cast<int>(fy);
  const double u = smoothstep(x - fx), v = smoothstep(y - fy);
  const double low = hash01(i, j, seed) * (1 - u) + hash01(i + 1, j, seed) * u;
  const double high = hash01(i, j + 1, seed) * (1 - u) + hash01(i + 1, j + 1, seed) * u;
  return low * (1 - v) + high * v;
}

Painter::Painter() {
  // Cosine-weighted directions about +Z on a spiral. They are the same for every point, so that
  // neighbours differ by their surroundings only, not by chance.
  constexpr int kRays = 56;
  for (int i = 0; i < kRays; ++i) {
    const double r2 = (i + 0.5) / kRays, r = std::sqrt(r2);
    const double a = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    hemisphere_.push_back({r * std::cos(a), r * std::sin(a), std::sqrt(1.0 - r2)});
  }
}

Room& Painter::add_room(const Box& inside, const Vec3d& bounce) {
  Room r{.inside = inside, .bounce = bounce};
  rooms_.push_back(std::move(r));
  place();
  return rooms_.back();
}

void Painter::place(const Vec3d& origin, double yaw) {
  origin_ = origin;
  turn_ = axis_angle(Vec3d{0, 1, 0}, yaw);
}

void Painter::patch(Field position, Field color, Spacing spacing, int cells_s, int cells_t, bool glows) {
  const Vec3d o = origin_;
  const Mat3d turn = rotation_matrix(turn_);
  patches_.push_back({[o, turn, position = std::move(position)](double s, double t) {
                        return turn * position(s, t) + o;
                      },
                      std::move(color), spacing, cells_s, cells_t, glows, cells_s * cells_t == 1,
                      rooms_.size() - 1});
}

void Painter::rect(const Vec3d& o, const Vec3d& a, const Vec3d& b, Field color, Spacing spacing,
                   bool glows) {
  patch([=](double s, double t) { return o + a * s + b * t; }, std::move(color), spacing, 1, 1, glows);
}

Box Painter::world_box(const Vec3d& low, const Vec3d& high) const noexcept {
  Box b;
  for (int corner = 0; corner < 8; ++corner) {
    b.add(world({(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y,
                 (corner & 4) != 0 ? high.z : low.z}));
  }
  return b;
}

void Painter::blocker(const Vec3d& low, const Vec3d& high) {
  room().blockers.push_back(world_box(low, high));
}

void Painter::cover(const Vec3d& low, const Vec3d& high) {
  room().covered.push_back(world_box(low, high));
}

void Painter::box(const Vec3d& l, const Vec3d& h, const Field& color, Spacing spacing, unsigned faces,
                  bool blocks) {
  const Vec3d d = h - l;
  const Vec3d x{d.x, 0, 0}, y{0, d.y, 0}, z{0, 0, d.z};
  if ((faces & kXn) != 0) rect(l, z, y, color, spacing);
  if ((faces & kXp) != 0) rect({h.x, l.y, h.z}, -z, y, color, spacing);
  if ((faces & kYn) != 0) rect(l, x, z, color, spacing);
  if ((faces & kYp) != 0) rect({l.x, h.y, h.z}, x, -z, color, spacing);
  if ((faces & kZn) != 0) rect({h.x, l.y, l.z}, -x, y, color, spacing);
  if ((faces & kZp) != 0) rect({l.x, l.y, h.z}, x, y, color, spacing);
  if (blocks) blocker(l, h);
}

void Painter::rounded_box(const Vec3d& low, const Vec3d& high, double radius, const Field& color,
                          Spacing spacing, bool blocks) {
  const Vec3d center = (low + high) * 0.5, half = (high - low) * 0.5;
  const double r = std::min({radius, half.x, half.y, half.z});
  const Vec3d core = half - Vec3d{r, r, r};
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      if (axis == 1 && sign < 0) continue;  // undersides are never visible
      const int i = (axis + 1) % 3, j = (axis + 2) % 3;
      const auto position = [=](double s, double t) {
        const double a = sign > 0 ? s : t, b = sign > 0 ? t : s;
        Vec3d q{};
        q[axis] = sign * half[axis];
        q[i] = half[i] * (2 * a - 1);
        q[j] = half[j] * (2 * b - 1);
        Vec3d c = q;
        for (int k = 0; k < 3; ++k) c[k] = std::clamp(q[k], -core[k], core[k]);
        return center + c + normalized(q - c) * r;
      };
      patch(position, color, spacing, 6, 6);
    }
  }
  if (blocks) {
    const double inset = 0.25 * r;
    blocker(low + Vec3d{inset, 0, inset}, high - Vec3d{inset, inset, inset});
  }
}

void Painter::cone(const Vec3d& base, double radius0, double radius1, double height, const Field& color,
                   Spacing spacing, bool cap, bool glows) {
  patch(
      [=](double s, double t) {
        const double a = -2 * std::numbers::pi * s, r = radius0 + (radius1 - radius0) * t;
        return base + Vec3d{r * std::cos(a), height * t, r * std::sin(a)};
      },
      color, spacing, 12, 1 + (height > 0.5 ? 1 : 0), glows);
  if (cap) disc(base + Vec3d{0, height, 0}, radius1, color, spacing);
}

void Painter::disc(const Vec3d& center, double radius, const Field& color, Spacing spacing) {
  patch(
      [=](double s, double t) {
        const double a = -2 * std::numbers::pi * s, r = radius * (1 - t);
        return center + Vec3d{r * std::cos(a), 0, r * std::sin(a)};
      },
      color, spacing, 16, 1);
}

void Painter::ellipsoid(const Vec3d& center, const Vec3d& radii, const Field& color, Spacing spacing,
                        bool glows) {
  patch(
      [=](double s, double t) {
        const double a = -2 * std::numbers::pi * s, b = std::numbers::pi * (t - 0.5);
        return center + Vec3d{radii.x * std::cos(b) * std::cos(a), radii.y * std::sin(b),
                              radii.z * std::cos(b) * std::sin(a)};
      },
      color, spacing, 12, 6, glows);
}

}  // namespace gsnav::flat
