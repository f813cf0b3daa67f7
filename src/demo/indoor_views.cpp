// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/demo/indoor_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/core/field_check.hpp"

namespace gsnav {
namespace {

constexpr double kClear = 0.4;       // free distance around a camera, metres
constexpr double kLeastSight = 1.5;  // metres
constexpr double kDown = 0.12;       // slope of a view

Status validate(const IndoorViewOptions& o) {
  detail::FieldCheck check("");
  check.in("count", o.count, 1, 10000).in("width", o.width, 1, 16384).in("height", o.height, 1, 16384);
  return check.in("hfov", o.hfov, 10, 150).in("eye_height", o.eye_height, 0.3, 2.2).status();
}

/// The mesh of a scene, for testing whether a place is free and how far a ray goes.
class Surfaces {
 public:
  explicit Surfaces(const DefaultScene& scene) {
    for (const auto& t : scene.triangles) {
      const Vec3d& a = scene.vertices[t[0]];
      triangles_.push_back({a, scene.vertices[t[1]] - a, scene.vertices[t[2]] - a});
      Aabb<double> box;
      for (const std::uint32_t v : t) box.add(scene.vertices[v]);
      boxes_.push_back(box);
      bounds_.add(box);
    }
  }

  const Aabb<double>& bounds() const noexcept { return bounds_; }

  bool free(const Aabb<double>& box) const noexcept {
    return std::none_of(boxes_.begin(), boxes_.end(), [&](const Aabb<double>& b) {
      return b.low.x < box.high.x && box.low.x < b.high.x && b.low.y < box.high.y &&
             box.low.y < b.high.y && b.low.z < box.high.z && box.low.z < b.high.z;
    });
  }

  /// Distance along a unit ray to the first triangle; infinity if there is none.
  double first(const Vec3d& eye, const Vec3d& ray) const noexcept {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& t : triangles_) {
      const Vec3d p = cross(ray, t.v);
      const double det = dot(t.u, p);
      if (det == 0) continue;
      const Vec3d s = eye - t.corner, q = cross(s, t.u);
      const double a = dot(s, p) / det, b = dot(ray, q) / det, along = dot(t.v, q) / det;
      if (a >= 0 && b >= 0 && a + b <= 1 && along > 0) nearest = std::min(nearest, along);
    }
    return nearest;
  }

 private:
  struct Triangle {
    Vec3d corner, u, v;
  };
  std::vector<Triangle> triangles_;
  std::vector<Aabb<double>> boxes_;
  Aabb<double> bounds_{};
};

/// The direction for which the shortest of it and its two neighbours is longest. Nothing if none is long
/// enough.
std::optional<Vec3d> longest_sight(const Surfaces& surfaces, const Vec3d& eye, double turn) {
  constexpr int kDirections = 18;
  const auto direction = [&](int i) {
    const double yaw = turn + 2 * std::numbers::pi * i / kDirections;
    return normalized(Vec3d{std::cos(yaw), -kDown, std::sin(yaw)});
  };
  std::array<double, kDirections> sight{};
  for (int i = 0; i < kDirections; ++i) {
    sight[static_cast<std::size_t>(i)] = surfaces.first(eye, direction(i));
  }
  double furthest = kLeastSight;
  std::optional<Vec3d> best;
  for (int i = 0; i < kDirections; ++i) {
    const auto at = [&](int k) {
      return sight[static_cast<std::size_t>((i + k + kDirections) % kDirections)];
    };
    const double seen = std::min({at(-1), at(0), at(1)});
    if (seen <= furthest || std::isinf(at(0))) continue;
    furthest = seen;
    best = direction(i);
  }
  return best;
}

struct ViewRay {
  Vec3d eye, ray;
};

/// A random view. Nothing if too many places in a row were not free.
std::optional<ViewRay> random_view(const Surfaces& surfaces, double height, Rng& rng) {
  const Aabb<double>& all = surfaces.bounds();
  constexpr int kTries = 1000;
  for (int i = 0; i < kTries && !all.empty(); ++i) {
    const Vec3d eye{rng.uniform(all.low.x, all.high.x), height, rng.uniform(all.low.z, all.high.z)};
    const double turn = rng.uniform(0, 2 * std::numbers::pi);
    constexpr double kAboveRugs = 0.1;
    if (!surfaces.free({{eye.x - kClear, kAboveRugs, eye.z - kClear},
                        {eye.x + kClear, eye.y + kClear, eye.z + kClear}}))
      continue;
    if (const auto ray = longest_sight(surfaces, eye, turn)) return ViewRay{eye, *ray};
  }
  return {};
}

}  // namespace

Result<std::vector<Camera>> indoor_views(const DefaultScene& scene, const IndoorViewOptions& o) {
  if (Status s = validate(o); !s) return s;
  const Surfaces surfaces(scene);
  Rng rng(o.seed);
  std::vector<Camera> out;
  std::vector<Vec3d> eyes;
  while (static_cast<int>(out.size()) < o.count) {
    // Take the candidate furthest from all earlier views, so that views spread over the rooms.
    constexpr int kCandidates = 6;
    std::optional<ViewRay> best;
    double furthest = -1;
    for (int i = 0; i < kCandidates; ++i) {
      const auto view = random_view(surfaces, o.eye_height, rng);
      if (!view) break;
      double nearest = std::numeric_limits<double>::max();
      for (const Vec3d& e : eyes) nearest = std::min(nearest, norm(e - view->eye));
      if (nearest <= furthest) continue;
      furthest = nearest;
      best = view;
    }
    if (!best) {
      return {Errc::nothing_navigable, "no place for an eye at " + std::to_string(o.eye_height) +
                                           " m found between the scene's surfaces"};
    }
    eyes.push_back(best->eye);
    out.push_back(
        Camera::look_at(best->eye, best->eye + best->ray, {0, 1, 0}, o.width, o.height, o.hfov));
  }
  return out;
}

}  // namespace gsnav
