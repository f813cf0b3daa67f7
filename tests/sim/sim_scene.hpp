// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "flat_world.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/rigging/body_levels.hpp"
#include "gsnav/detail/sim/scene_on_backend.hpp"

namespace gsnav_test {

/// The flat, with few Gaussians and nobody in it.
inline gsnav::SimulatorScene flat_scene() {
  static const auto cloud =
      std::make_shared<const gsnav::GaussianCloud>(gsnav::make_default_scene(0.05).value().cloud);
  gsnav::SimulatorScene s;
  s.assets.push_back({cloud, {}});
  s.navmesh = flat_navmesh();
  return s;
}

/// Two people who walk to and fro across the living room.
inline gsnav::SimulatorScene peopled_scene(int gaussians = 3000) {
  using namespace gsnav;
  SimulatorScene s = flat_scene();
  HumanoidOptions look;
  look.gaussians = gaussians;
  const auto body = std::make_shared<const AvatarAsset>(make_humanoid(look));
  s.avatars.push_back(make_walker(body, {{3.4, 0, 3.7}, {5.4, 0, 3.0}}).value());
  s.avatars.push_back(make_walker(body, {{5.3, 0, 1.6}, {3.6, 0, 2.9}, {4.6, 0, 4.0}}).value());
  return s;
}

/// Builds levels of detail of the people, who share one body.
inline void give_body_levels(gsnav::SimulatorScene& s) {
  using namespace gsnav;
  auto body = std::make_shared<AvatarAsset>(*s.avatars[0].asset());
  body->levels = body_levels(*body).value();
  for (AvatarActor& a : s.avatars) a = a.with_body(body).value();
}

inline gsnav::PointNavEpisode to_kitchen() {
  gsnav::PointNavEpisode e;
  e.start_position = {4.6, 0, 3.6};
  e.goal_position = {8.8, 0, 3.4};
  return e;
}

}  // namespace gsnav_test
