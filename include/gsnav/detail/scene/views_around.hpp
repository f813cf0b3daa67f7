// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/math/aabb.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// `count` cameras with a field of view of 60 degrees on a circle around a box, slightly above its
/// middle, looking at the middle.
/// @param up unit axis of the asset's frame that points up (`LoadReport::up`, `guess_up`).
inline std::vector<Camera> views_around(const Aabb<double>& box, const Vec3d& up, int count, int width,
                                        int height) {
  std::vector<Camera> out;
  const Vec3d middle = (box.low + box.high) * 0.5;
  const double distance = 1.8 * std::max(0.5 * norm(box.high - box.low), 1e-3);
  const Vec3d side = std::fabs(up.z) < 0.5 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
  const Vec3d across = normalized(side - up * dot(side, up)), other = cross(across, up);
  constexpr double kPi = std::numbers::pi;
  for (int v = 0; v < count; ++v) {
    const double angle = 2 * kPi * v / count;
    const Vec3d eye =
        middle + (across * std::cos(angle) - other * std::sin(angle) + up * 0.35) * distance;
    out.push_back(Camera::look_at(eye, middle, up, width, height, 60));
  }
  return out;
}

/// Cameras around a cloud. Its outermost tenth on each side is left out of the box. Empty for an empty
/// cloud.
inline std::vector<Camera> views_around(const GaussianCloud& cloud, const Vec3d& up, int count,
                                        int width, int height) {
  if (cloud.size() == 0) return {};
  Aabb<double> box;
  std::vector<double> along(cloud.size());
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < along.size(); ++i) along[i] = cloud.mean(i)[k];
    const auto at = [&along](double share) {
      const auto n = static_cast<std::ptrdiff_t>(share * static_cast<double>(along.size() - 1));
      std::nth_element(along.begin(), along.begin() + n, along.end());
      return along[static_cast<std::size_t>(n)];
    };
    box.low[k] = at(0.1);
    box.high[k] = at(0.9);
  }
  return views_around(box, up, count, width, height);
}

}  // namespace gsnav
