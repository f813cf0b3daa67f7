// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/nav/viewpoints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>

namespace gsnav {

namespace {

/// Positions tried along each axis of a cube.
constexpr int kTries = 4;
/// Largest height, metres. Numbers of cubes must fit in 64 bits.
constexpr double kMaxHeight = 1e6;

using Key = std::array<std::int64_t, 3>;

struct Choice {
  double distance;  // Squared distance from the middle of the cube on the ground plane.
  Vec3d place;
};

void offer(std::map<Key, Choice>& chosen, const Vec3d& floor, double height, double spacing) {
  const Vec3d place{floor.x, floor.y + height, floor.z};
  Key key;
  for (int k = 0; k < 3; ++k)
    key[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(place[k] / spacing));
  const double dx = place.x / spacing - static_cast<double>(key[0]) - 0.5;
  const double dz = place.z / spacing - static_cast<double>(key[2]) - 0.5;
  const Choice here{dx * dx + dz * dz, place};
  const auto [at, is_new] = chosen.try_emplace(key, here);
  const auto order = [](const Choice& c) {
    return std::array{c.distance, c.place.x, c.place.z, c.place.y};
  };
  if (!is_new && order(here) < order(at->second)) at->second = here;
}

/// Calls f(point) for the centroid of a triangle and for points on it of a lattice with spacing `step`.
template <class F>
void for_each_place(const std::array<Vec3d, 3>& t, double step, const F& f) {
  f((t[0] + t[1] + t[2]) * (1.0 / 3));
  const auto ends = std::minmax({t[0].x, t[1].x, t[2].x});
  const double area = (t[1].x - t[0].x) * (t[2].z - t[0].z) - (t[2].x - t[0].x) * (t[1].z - t[0].z);
  if (area == 0) return;
  const auto depth = std::minmax({t[0].z, t[1].z, t[2].z});
  // Offset by half a step, so that some position is near the middle of every cube.
  const auto first = [step](double low) { return (std::ceil(low / step - 0.5) + 0.5) * step; };
  for (double x = first(ends.first); x <= ends.second; x += step) {
    for (double z = first(depth.first); z <= depth.second; z += step) {
      const auto part = [&](const Vec3d& a, const Vec3d& b) {
        return ((b.x - a.x) * (z - a.z) - (x - a.x) * (b.z - a.z)) / area;
      };
      const double c = part(t[0], t[1]), a = part(t[1], t[2]), b = part(t[2], t[0]);
      if (a < 0 || b < 0 || c < 0) continue;
      f(Vec3d{x, a * t[0].y + b * t[1].y + c * t[2].y, z});
    }
  }
}

}  // namespace

Result<std::vector<Vec3d>> navmesh_viewpoints(const NavMesh& mesh, std::span<const double> heights,
                                              double spacing) {
  if (!(spacing >= 0.01 && std::isfinite(spacing))) {
    return Status(Errc::invalid_argument, "navmesh_viewpoints: spacing = " + std::to_string(spacing) +
                                              ": must be at least 0.01");
  }
  if (heights.empty()) return Status(Errc::invalid_argument, "navmesh_viewpoints: no height");
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (!(std::abs(heights[i]) <= kMaxHeight)) {
      return Status(Errc::invalid_argument, "navmesh_viewpoints: heights[" + std::to_string(i) +
                                                "] = " + std::to_string(heights[i]) +
                                                ": must be within 1e6 metres");
    }
  }
  std::map<Key, Choice> chosen;
  for (const std::array<Vec3d, 3>& triangle : mesh.triangles()) {
    for_each_place(triangle, spacing / kTries, [&](const Vec3d& floor) {
      for (const double h : heights) offer(chosen, floor, h, spacing);
    });
  }
  std::vector<Vec3d> out;
  out.reserve(chosen.size());
  for (const auto& [key, choice] : chosen) out.push_back(choice.place);
  return out;
}

}  // namespace gsnav
