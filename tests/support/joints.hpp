// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/avatar/actor.hpp"

namespace gsnav_test {

/// Where an actor's joints are at time t: [J], metres, world.
inline std::vector<gsnav::Vec3d> joints_in_world(const gsnav::AvatarActor& actor, double t) {
  std::vector<gsnav::Affine3<double>> joints;
  actor.joint_globals(t, joints);
  const gsnav::Similarity world = actor.placement(t);
  std::vector<gsnav::Vec3d> out;
  for (const auto& joint : joints) out.push_back(world * joint.translation);
  return out;
}

}  // namespace gsnav_test
