// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"
#include "gsnav/detail/sim/sensor.hpp"

namespace gsnav_test {

inline gsnav::SurfaceMesh box(const gsnav::Vec3f& low, const gsnav::Vec3f& high) {
  gsnav::SurfaceMesh m;
  for (int i = 0; i < 8; ++i) {
    m.geometry.vertices.push_back(
        {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y, (i & 4) != 0 ? high.z : low.z});
  }
  m.geometry.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  m.base_color = {0.2f, 0.7f, 0.1f};
  return m;
}

/// A box of 0.8 m that stands turned before the agent, as a surface of one part.
inline gsnav::SceneMesh turned_box(double yaw) {
  auto surface = std::make_shared<gsnav::PlacedMeshes>();
  surface->instances.push_back(
      {surface->meshes.add(box({-0.4f, 0, -0.4f}, {0.4f, 0.8f, 0.4f})).value(), {}});
  return {surface, {gsnav::yaw_rotation(yaw), {4.6, 0, 1.9}, 1.0}};
}

}  // namespace gsnav_test
