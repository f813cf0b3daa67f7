// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "gsnav/detail/nav/episode.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Rotation about +Y. Positive angles (radians) turn to the left.
inline Quatd yaw_rotation(double radians) noexcept {
  return {std::cos(0.5 * radians), 0.0, std::sin(0.5 * radians), 0.0};
}

/// Rules for sampling episodes. The defaults are those of Habitat's generator.
struct EpisodeRules {
  double min_distance = 1.0;           ///< Smallest geodesic distance, metres.
  double max_distance = 30.0;          ///< Largest geodesic distance, metres.
  double min_island_radius = 1.5;      ///< Smallest radius of an island that points are taken from,
                                       ///< metres.
  double max_height_difference = 0.5;  ///< Largest height difference of start and goal, metres.
  /// A path whose ratio of length to straight distance is below this is accepted only with probability
  /// 20 (ratio - 0.98)^2.
  double straight_ratio = 1.1;
  int retries_per_goal = 10;  ///< Number of starts to try per goal.
  /// Number of goals to try before an episode fails. Times retries_per_goal, at most 10^6.
  int max_goals = 2000;
};

/// Checks the values.
/// @return invalid_argument, with the field that is out of range.
Status validate(const EpisodeRules& rules);

/// Samples one episode. The same NavMesh, generator state and rules give the same episode.
/// @return invalid_argument for a rule out of range; nothing_navigable if no pair of points satisfied
/// the rules.
Result<PointNavEpisode> generate_episode(const NavMesh& navmesh, Rng& rng,
                                         const EpisodeRules& rules = {});

/// Samples `count` episodes with ids "0", "1", ...
/// @param progress receives the share that is done, before each episode. An exception ends the work.
/// @return the errors of generate_episode; invalid_argument for a count above 10^7.
Result<std::vector<PointNavEpisode>> generate_episodes(const NavMesh& navmesh, std::size_t count,
                                                       std::uint64_t seed,
                                                       const EpisodeRules& rules = {},
                                                       const std::function<void(double)>& progress = {});

}  // namespace gsnav
