// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "canvas.hpp"
#include "gsnav/math/capsule.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace nav_loop {

/// What the map of one episode shows. World frame, metres.
struct MapContent {
  const gsnav::GaussianCloud* cloud = nullptr;
  gsnav::Similarity world_from_asset{};
  const gsnav::NavMesh* navmesh = nullptr;
  gsnav::Vec3d start{}, goal{};
  std::vector<gsnav::Vec3d> shortest;              ///< planned before the episode
  std::vector<gsnav::Vec3d> agent;                 ///< one point a step
  std::vector<std::vector<gsnav::Vec3d>> avatars;  ///< where each one's root went
  /// All bodies' capsules at a few times; the last is the end.
  std::vector<std::vector<gsnav::DynamicCapsule>> snapshots;
  double agent_radius = 0.1;
};

/// The scene from above without its ceiling, washed out, with everything else on top.
Canvas draw_map(const MapContent& content);

/// Colour of an avatar in maps.
Rgb avatar_color(std::size_t index);

}  // namespace nav_loop
