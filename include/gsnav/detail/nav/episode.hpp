// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/math/quat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// One point-goal task: go from a start to a goal. World frame: metres, Y up; the agent's forward is
/// -Z turned by `start_rotation`.
struct PointNavEpisode {
  std::string id;                  ///< Name of the episode, unique in its file.
  Vec3d start_position{};          ///< Where the agent starts, metres.
  Quatd start_rotation{};          ///< w, x, y, z; a turn about +Y
  Vec3d goal_position{};           ///< Where the goal is, metres.
  double geodesic_distance = 0.0;  ///< from start to goal along the surface, metres
  double start_time = 0.0;         ///< seconds on the avatars' clock when the episode begins
  double goal_radius = 0.2;        ///< metres, as files say; success is decided by TaskConfig
  std::string scene_id;            ///< which scene, as files name it; empty where there is one
};

}  // namespace gsnav
