// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav_test {

/// The flat's mesh-built NavMesh, made once.
inline std::shared_ptr<const gsnav::NavMesh> flat_navmesh() {
  static const auto mesh = [] {
    const gsnav::DefaultScene s = gsnav::make_default_scene(0.05).value();
    return std::make_shared<const gsnav::NavMesh>(
        gsnav::NavMesh::build({}, s.vertices, s.triangles).value());
  }();
  return mesh;
}

/// Upright bodies that circle in the living room at walking speed.
inline void circling_bodies(double t0, double t1, std::vector<gsnav::DynamicCapsule>& out) {
  const auto at = [](int k, double t) {
    const double a = (k % 2 == 0 ? 0.7 : -0.6) * t + 2.1 * k, r = 0.8 + 0.35 * k;
    const gsnav::Vec3d foot{3.4 + r * std::cos(a), 0.25, 2.9 + 0.7 * r * std::sin(a)};
    return gsnav::Capsule<double>{foot, foot + gsnav::Vec3d{0, 1.3, 0}, 0.22};
  };
  for (int k = 0; k < 3; ++k) {
    out.push_back({{at(k, t0), at(k, t1)}, static_cast<std::uint32_t>(k), 0});
  }
}

inline gsnav::World flat_world(const gsnav::TaskConfig& config = {},
                               gsnav::World::BodySource bodies = {}) {
  return gsnav::World::create(flat_navmesh(), config, std::move(bodies)).value();
}

}  // namespace gsnav_test
