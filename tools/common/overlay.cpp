// SPDX-License-Identifier: Apache-2.0
#include "overlay.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "map.hpp"

namespace gsnav_tools {
namespace {

using gsnav::Vec3d;

constexpr Rgb kNavMeshEdge{0.25f, 0.75f, 1.0f};
constexpr double kNear = 0.05;     // Metres. Nearer points are not drawn.
constexpr double kSurface = 0.12;  // Metres that a line on the floor may lie behind the depth of the
                                   // scene.
constexpr double kBody = 0.6;      // Metres for the axis of a body, which is inside its surface.
constexpr double kPiece = 0.15;    // Length of the pieces of a line that are hidden or shown as a whole,
                                   // metres.

struct Point {
  double x, y, z;
};

std::optional<Point> project(const gsnav::Camera& c, const Vec3d& p) {
  const Vec3d v = c.viewmat * p;
  if (v.z < kNear) return {};
  return Point{c.fx * v.x / v.z + c.cx, c.fy * v.y / v.z + c.cy, v.z};
}

bool visible(const DrawnView& view, const Point& p, double behind) {
  const gsnav::Camera& c = view.camera;
  if (!(p.x >= 0 && p.y >= 0 && p.x < c.width && p.y < c.height)) return false;
  const auto at =
      static_cast<std::size_t>(p.y) * static_cast<std::size_t>(c.width) + static_cast<std::size_t>(p.x);
  const double z = static_cast<double>(view.depth[at]);
  return z == 0 || p.z < z + behind;
}

void draw_line(const DrawnView& view, const Vec3d& a, const Vec3d& b) {
  const int pieces = std::max(1, static_cast<int>(std::ceil(norm(b - a) / kPiece)));
  std::optional<Point> from = project(view.camera, a);
  for (int i = 1; i <= pieces; ++i) {
    const std::optional<Point> to = project(view.camera, lerp(a, b, static_cast<double>(i) / pieces));
    if (from && to &&
        visible(view, {0.5 * (from->x + to->x), 0.5 * (from->y + to->y), 0.5 * (from->z + to->z)},
                kSurface)) {
      view.canvas.stroke(from->x, from->y, to->x, to->y, 0.7, kNavMeshEdge, 0.7f);
    }
    from = to;
  }
}

}  // namespace

void draw_navmesh(const DrawnView& view, std::span<const std::array<Vec3d, 3>> triangles, double reach) {
  const Vec3d eye = view.camera.position();
  for (const auto& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d &a = t[i], &b = t[(i + 1) % 3];
      if (std::min(norm(a - eye), norm(b - eye)) < reach) draw_line(view, a, b);
    }
  }
}

void draw_capsule(const DrawnView& view, const gsnav::Capsule<double>& c, Rgb color, float alpha) {
  const auto a = project(view.camera, c.p0), b = project(view.camera, c.p1);
  if (!a || !b) return;
  const Point middle{0.5 * (a->x + b->x), 0.5 * (a->y + b->y), 0.5 * (a->z + b->z)};
  if (!visible(view, middle, kBody)) return;
  const double radius = view.camera.fx * c.radius / middle.z;
  view.canvas.stroke(a->x, a->y, b->x, b->y, std::min(radius, 400.0), color, alpha);
}

void draw_capsules(const DrawnView& view, std::span<const gsnav::DynamicCapsule> bodies) {
  for (const gsnav::DynamicCapsule& body : bodies)
    draw_capsule(view, body.motion.begin, avatar_color(body.avatar), 0.35f);
}

}  // namespace gsnav_tools
