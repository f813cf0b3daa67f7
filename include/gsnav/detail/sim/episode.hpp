// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "gsnav/detail/nav/episode.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/nav/navmesh.hpp"

namespace gsnav {

/// Rotation about +Y: positive angles (radians) turn the agent left.
inline Quatd yaw_rotation(double radians) noexcept {
  return {std::cos(0.5 * radians), 0.0, std::sin(0.5 * radians), 0.0};
}

/// What makes a pair of points an episode. Defaults are Habitat's generator.
struct EpisodeRules {
  double min_distance = 1.0;           ///< least geodesic distance, metres
  double max_distance = 30.0;          ///< largest geodesic distance, metres
  double min_island_radius = 1.5;      ///< points on smaller islands are not used, metres
  double max_height_difference = 0.5;  ///< between start and goal, metres
  /// A path less than this much longer than the straight line is kept only sometimes: with probability
  /// 20 (ratio - 0.98)^2.
  double straight_ratio = 1.1;
  int retries_per_goal = 10;  ///< starts tried for a goal before another goal is drawn
  int max_goals = 2000;       ///< goals drawn before giving up on an episode
};

/// invalid_argument, naming the field, where a value is impossible.
Status validate(const EpisodeRules& rules);

/// Draws one episode. The same NavMesh, generator state and rules give the same episode.
/// Errors: invalid_argument (a rule), nothing_navigable where no pair that fits was found.
Result<PointNavEpisode> generate_episode(const NavMesh& navmesh, Rng& rng,
                                         const EpisodeRules& rules = {});

/// Draws `count` episodes with ids "0", "1", ... from one seed. Errors: as above.
Result<std::vector<PointNavEpisode>> generate_episodes(const NavMesh& navmesh, std::size_t count,
                                                       std::uint64_t seed,
                                                       const EpisodeRules& rules = {});

}  // namespace gsnav
