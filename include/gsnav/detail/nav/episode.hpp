// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/math/quat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// One point-goal task: go from a start to a goal. World frame: metres, Y up; the agent's forward is
/// -Z turned by `start_rotation`.
struct PointNavEpisode {
  std::string id;
  Vec3d start_position{};
  Quatd start_rotation{};  ///< w, x, y, z; a turn about +Y
  Vec3d goal_position{};
  double geodesic_distance = 0.0;  ///< from start to goal along the surface, metres
  double start_time = 0.0;         ///< seconds on the avatars' clock when the episode begins
  double goal_radius = 0.2;        ///< metres, as files say; success is decided by TaskConfig
  std::string scene_id;            ///< which scene, as files name it; empty where there is one
};

}  // namespace gsnav
