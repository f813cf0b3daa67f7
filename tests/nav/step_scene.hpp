// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gsnav/detail/nav/step.hpp"
#include "meshes.hpp"

namespace gsnav_test {

/// A room of 220 m by 220 m around the origin.
inline gsnav::NavMesh room() {
  Soup soup;
  soup.floor(-110, -110, 110, 110);
  gsnav::NavMeshSettings s;
  s.cell_size = 0.5;
  return gsnav::NavMesh::build(s, soup.vertices, soup.triangles).value();
}

inline gsnav::AgentState agent_at(double x, double z) { return {{x, 0, z}, 0.1, 1.5, gsnav::kNoPoly}; }

/// Walking bodies around the origin, each of some bones that sway and change their radius. Speeds in
/// metres a tick.
inline std::vector<gsnav::DynamicCapsule> crowd(gsnav::Rng& rng, double speed, int avatars = 6,
                                                int bones = 8) {
  using gsnav::Vec3d;
  std::vector<gsnav::DynamicCapsule> list;
  for (int a = 0; a < avatars; ++a) {
    const double x = rng.uniform(-4, 4), z = rng.uniform(-4, 4);
    const double vx = rng.uniform(-speed, speed), vz = rng.uniform(-speed, speed);
    const Vec3d where{x, 0, z}, v{vx, 0, vz};
    const auto around = [&](double side, double low, double high) {
      const double dx = rng.uniform(-side, side), dy = rng.uniform(low, high),
                   dz = rng.uniform(-side, side);
      return Vec3d{dx, dy, dz};
    };
    for (int b = 0; b < bones; ++b) {
      const Vec3d p0 = where + around(0.3, 0.05, 1.8), p1 = where + around(0.3, 0.05, 1.8);
      const Vec3d q0 = p0 + v + around(0.2, -0.1, 0.1), q1 = p1 + v + around(0.2, -0.1, 0.1);
      const double r0 = rng.uniform(0.03, 0.15), r1 = rng.uniform(0.03, 0.15);
      list.push_back(
          {{{p0, p1, r0}, {q0, q1, r1}}, static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)});
    }
  }
  return list;
}

/// The same bodies where they begin, for the whole tick.
inline std::vector<gsnav::DynamicCapsule> frozen(std::vector<gsnav::DynamicCapsule> list) {
  for (gsnav::DynamicCapsule& c : list) c.motion.end = c.motion.begin;
  return list;
}

}  // namespace gsnav_test
