// SPDX-License-Identifier: Apache-2.0
#include "map.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gsnav/demo.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav_tools {
namespace {

using gsnav::Vec3d;

constexpr Rgb kEdge{0.20f, 0.47f, 0.70f}, kInk{0.1f, 0.1f, 0.1f};
constexpr double kMargin = 0.6;       // Metres around the NavMesh.
constexpr double kLeastIsland = 1.5;  // Metres. Episodes use no smaller islands.
constexpr double kCutHeight = 1.95;   // Metres above the floor. Higher parts of the scene would hide the
                                      // rooms.

void draw_scene(Canvas& canvas, const MapFrame& f, const MapContent& m, double floor) {
  const gsnav::GaussianCloud& c = *m.cloud;
  std::vector<Vec3d> at(c.size());
  std::vector<std::uint32_t> order;
  for (std::size_t i = 0; i < c.size(); ++i) {
    at[i] = m.world_from_asset * c.mean(i);
    const bool in_picture = f.x(at[i]) > -50 && f.y(at[i]) > -50 && f.x(at[i]) < canvas.width() + 50 &&
                            f.y(at[i]) < canvas.height() + 50;
    if (in_picture && at[i].y > floor - 0.3 && at[i].y < floor + kCutHeight && c.opacities[i] > 0.1f) {
      order.push_back(static_cast<std::uint32_t>(i));
    }
  }
  // Paint from the floor up. Ties are in file order, so that the picture is reproducible.
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return at[a].y < at[b].y; });
  for (const std::uint32_t i : order) {
    // Seen from above, a Gaussian is a stroke along its longest axis with the width of its middle axis.
    const double sizes[3] = {c.scales[0][i], c.scales[1][i], c.scales[2][i]};
    const auto axis = static_cast<int>(std::max_element(sizes, sizes + 3) - sizes);
    const double longest = sizes[axis], least = *std::min_element(sizes, sizes + 3);
    const double middle = sizes[0] + sizes[1] + sizes[2] - longest - least;
    const double k_pixels = 1.3 * m.world_from_asset.scale * f.scale;
    const double radius = std::clamp(k_pixels * middle, 0.7, 8.0);
    const gsnav::Quatd q{c.quats[0][i], c.quats[1][i], c.quats[2][i], c.quats[3][i]};
    const Vec3d along = rotate(m.world_from_asset.rotation, rotation_matrix(q).column(axis)) *
                        std::clamp(k_pixels * (longest - middle), 0.0, 12.0);
    Rgb color;
    float* out[3] = {&color.r, &color.g, &color.b};
    for (std::size_t k = 0; k < 3; ++k) {
      *out[k] = std::clamp(0.5f + static_cast<float>(gsnav::kSh0) * c.sh0[3 * i + k], 0.0f, 1.0f);
    }
    const double x = f.x(at[i]), y = f.y(at[i]);
    canvas.stroke(x - along.x, y - along.z, x + along.x, y + along.z, radius, color,
                  0.85f * c.opacities[i]);
  }
}

void dashed(Canvas& canvas, const MapFrame& f, const std::vector<Vec3d>& points, double radius,
            Rgb color) {
  double phase = 0;  // Pixels along the whole line.
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double ax = f.x(points[i - 1]), ay = f.y(points[i - 1]), bx = f.x(points[i]),
                 by = f.y(points[i]);
    const double length = std::hypot(bx - ax, by - ay);
    for (double s = 0; s < length;) {
      const double in_dash = std::fmod(phase, 16.0);
      const double piece = std::min(length - s, (in_dash < 9 ? 9.0 : 16.0) - in_dash + 1e-6);
      if (in_dash < 9) {
        const double k0 = s / length, k1 = (s + piece) / length;
        canvas.stroke(ax + (bx - ax) * k0, ay + (by - ay) * k0, ax + (bx - ax) * k1, ay + (by - ay) * k1,
                      radius, color, 1.0f);
      }
      s += piece;
      phase += piece;
    }
  }
}

void scale_bar(Canvas& canvas, double scale) {
  double metres = 1;
  for (const double m : {2.0, 5.0, 10.0, 20.0, 50.0}) {
    if (metres * scale < 90) metres = m;
  }
  const int w = static_cast<int>(metres * scale), x = 24, y = canvas.height() - 34;
  canvas.rect(x - 10, y - 26, w + 20, 48, {1, 1, 1}, 0.75f);
  canvas.rect(x, y, w, 4, kInk, 1.0f);
  canvas.rect(x, y - 5, 3, 14, kInk, 1.0f);
  canvas.rect(x + w - 3, y - 5, 3, 14, kInk, 1.0f);
  canvas.text(x + w / 2 - 14, y - 20, std::to_string(static_cast<int>(metres)) + " m", 3, kInk);
}

}  // namespace

Rgb avatar_color(std::size_t index) {
  const Vec3d c = gsnav::person_color(index);
  return {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)};
}

MapFrame fit_map(const gsnav::NavMesh& navmesh, int width, int height) {
  const gsnav::Aabb<double> box = navmesh.bounds();
  const double w = box.high.x - box.low.x + 2 * kMargin, h = box.high.z - box.low.z + 2 * kMargin;
  const double scale = std::min(width / w, height / h);
  return {box.low.x - kMargin - 0.5 * (width / scale - w),
          box.low.z - kMargin - 0.5 * (height / scale - h), scale};
}

void draw_polyline(Canvas& canvas, const MapFrame& f, std::span<const Vec3d> points, double radius,
                   Rgb color, float alpha) {
  for (std::size_t i = 1; i < points.size(); ++i) {
    canvas.stroke(f.x(points[i - 1]), f.y(points[i - 1]), f.x(points[i]), f.y(points[i]), radius, color,
                  alpha);
  }
}

void draw_bodies(Canvas& canvas, const MapFrame& f, std::span<const gsnav::DynamicCapsule> bodies,
                 float alpha) {
  for (const gsnav::DynamicCapsule& body : bodies) {
    const gsnav::Capsule<double>& c = body.motion.begin;
    canvas.stroke(f.x(c.p0), f.y(c.p0), f.x(c.p1), f.y(c.p1), c.radius * f.scale,
                  avatar_color(body.avatar), alpha);
  }
}

void draw_ground(Canvas& canvas, const MapFrame& f, const MapContent& m) {
  if (m.cloud != nullptr) draw_scene(canvas, f, m, m.start.y);
  canvas.rect(0, 0, canvas.width(), canvas.height(), {1, 1, 1}, 0.30f);

  for (const auto& t : m.navmesh->triangles()) {
    const gsnav::Vec2<double> p[3] = {
        {f.x(t[0]), f.y(t[0])}, {f.x(t[1]), f.y(t[1])}, {f.x(t[2]), f.y(t[2])}};
    const auto on = m.navmesh->snap_point((t[0] + t[1] + t[2]) * (1.0 / 3.0), {{0.1, 0.5, 0.1}});
    if (!on || m.navmesh->island_radius(m.navmesh->island_of(on->poly)) < kLeastIsland)
      continue;  // For example a table top.
    canvas.triangle(p, kMapNavMesh, 0.32f);
    for (int i = 0; i < 3; ++i)
      canvas.stroke(p[i].x, p[i].y, p[(i + 1) % 3].x, p[(i + 1) % 3].y, 0.4, kEdge, 0.35f);
  }
}

Canvas draw_map(const MapContent& m) {
  const gsnav::Aabb<double> box = m.navmesh->bounds();
  const double w = box.high.x - box.low.x + 2 * kMargin, h = box.high.z - box.low.z + 2 * kMargin;
  const double scale = 1200.0 / std::max(w, h);
  Canvas canvas(std::max(1, static_cast<int>(w * scale)), std::max(1, static_cast<int>(h * scale)),
                {0.96f, 0.96f, 0.96f});
  const MapFrame f{box.low.x - kMargin, box.low.z - kMargin, scale};
  draw_ground(canvas, f, m);
  for (std::size_t i = 0; i < m.avatars.size(); ++i)
    draw_polyline(canvas, f, m.avatars[i], 1.6, avatar_color(i), 0.75f);
  for (std::size_t k = 0; k < m.snapshots.size(); ++k)
    draw_bodies(canvas, f, m.snapshots[k], k + 1 == m.snapshots.size() ? 0.55f : 0.13f);
  dashed(canvas, f, m.shortest, 1.8, kMapShortest);
  draw_polyline(canvas, f, m.agent, 3.2, {1, 1, 1}, 0.9f);
  draw_polyline(canvas, f, m.agent, 2.2, kMapAgent, 1.0f);
  if (!m.agent.empty()) {
    const Vec3d& end = m.agent.back();
    canvas.disc(f.x(end), f.y(end), std::max(m.agent_radius * f.scale, 4.0), kMapAgent, 0.9f);
  }
  canvas.disc(f.x(m.start), f.y(m.start), 8, {1, 1, 1}, 1.0f);
  canvas.disc(f.x(m.start), f.y(m.start), 6, kMapStart, 1.0f);
  canvas.disc(f.x(m.goal), f.y(m.goal), 4, kMapGoal, 1.0f);
  canvas.ring(f.x(m.goal), f.y(m.goal), 10, 3, kMapGoal, 1.0f);
  scale_bar(canvas, f.scale);
  return canvas;
}

}  // namespace gsnav_tools
