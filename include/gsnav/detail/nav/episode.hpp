// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gsnav/math/quat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// A PointNav episode: the task to go from a start to a goal. World frame, metres, Y up. The agent's
/// forward direction is -Z turned by `start_rotation`.
struct PointNavEpisode {
  std::string id;                  ///< Name of the episode.
  Vec3d start_position{};          ///< Where the agent starts.
  Quatd start_rotation{};          ///< Turn about +Y (w, x, y, z).
  Vec3d goal_position{};           ///< Where the agent should go.
  double geodesic_distance = 0.0;  ///< Distance from start to goal along the surface, metres.
  double start_time = 0.0;         ///< Time on the avatars' clock at which the episode begins, seconds.
  double goal_radius = 0.2;        ///< Radius of the goal as stored in episode files, metres. TaskConfig
                                   ///< decides about success.
  std::string scene_id;            ///< Name of the scene as stored in episode files. Empty if there is
                                   ///< only one scene.
};

}  // namespace gsnav
