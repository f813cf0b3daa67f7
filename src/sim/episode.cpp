// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/episode.hpp"

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/math/angles.hpp"

namespace gsnav {
namespace {

constexpr double kMaxEpisodes = 1e7;  // of one call

/// Islands with a radius of at least `least_radius`.
std::vector<std::size_t> wide_islands(const NavMesh& navmesh, double least_radius) {
  std::vector<std::size_t> wide;
  for (std::size_t i = 0; i < navmesh.island_count(); ++i) {
    if (navmesh.island_radius(i) >= least_radius) wide.push_back(i);
  }
  return wide;
}

std::size_t draw_island(const NavMesh& navmesh, const std::vector<std::size_t>& islands, Rng& rng) {
  double total = 0;
  for (const std::size_t i : islands) total += navmesh.island_area(i);
  double at = rng.uniform() * total;
  for (const std::size_t i : islands) {
    at -= navmesh.island_area(i);
    if (at < 0) return i;
  }
  return islands.back();
}

}  // namespace

Status validate(const EpisodeRules& r) {
  detail::FieldCheck check("EpisodeRules.");
  const auto at_least = [&check](const char* field, auto value, auto least, const char* rule) {
    check.need(value >= least, field, value, rule);
  };
  check.not_negative("min_distance", r.min_distance);
  at_least("max_distance", r.max_distance, r.min_distance, "must be >= min_distance");
  at_least("min_island_radius", r.min_island_radius, 0.0, "must be >= 0");
  at_least("max_height_difference", r.max_height_difference, 0.0, "must be >= 0");
  at_least("straight_ratio", r.straight_ratio, 0.0, "must be >= 0");
  at_least("retries_per_goal", r.retries_per_goal, 1, "must be >= 1");
  at_least("max_goals", r.max_goals, 1, "must be >= 1");
  const double starts = static_cast<double>(r.max_goals) * r.retries_per_goal;
  check.need(starts <= 1e6, "max_goals", r.max_goals, "times retries_per_goal must be at most 1000000");
  return check.status();
}

Result<PointNavEpisode> generate_episode(const NavMesh& navmesh, Rng& rng, const EpisodeRules& rules) {
  if (Status s = validate(rules); !s) return s;
  const std::vector<std::size_t> islands = wide_islands(navmesh, rules.min_island_radius);
  if (islands.empty()) {
    return {Errc::nothing_navigable, "no island of the NavMesh has a radius of " +
                                         std::to_string(rules.min_island_radius) + " m"};
  }
  for (int goals = 0; goals < rules.max_goals; ++goals) {
    // Draw both from one island. A start on another island could not reach the goal.
    const std::size_t island = draw_island(navmesh, islands, rng);
    const Vec3d goal = navmesh.random_point(rng, island).position;
    for (int tries = 0; tries < rules.retries_per_goal; ++tries) {
      const Vec3d start = navmesh.random_point(rng, island).position;
      if (abs(start.y - goal.y) > rules.max_height_difference) continue;
      const double distance = navmesh.geodesic_distance(start, goal);
      if (!(distance >= rules.min_distance && distance <= rules.max_distance)) continue;
      const double ratio = distance / norm(goal - start);
      if (ratio < rules.straight_ratio) {
        const double excess = ratio - 0.98;
        if (rng.uniform() > 20.0 * excess * excess) continue;
      }
      PointNavEpisode e;
      e.start_position = start;
      e.goal_position = goal;
      e.start_rotation = yaw_rotation(rng.uniform(0.0, kTwoPi));
      e.geodesic_distance = distance;
      return e;
    }
  }
  return {Errc::nothing_navigable, "no start and goal between " + std::to_string(rules.min_distance) +
                                       " m and " + std::to_string(rules.max_distance) +
                                       " m apart were found on the NavMesh"};
}

Result<std::vector<PointNavEpisode>> generate_episodes(const NavMesh& navmesh, std::size_t count,
                                                       std::uint64_t seed, const EpisodeRules& rules,
                                                       const std::function<void(double)>& progress) {
  detail::FieldCheck check("generate_episodes: ");
  if (const Status s = check.in("count", count, 0, kMaxEpisodes).status(); !s) return s;
  Rng rng(seed);
  std::vector<PointNavEpisode> episodes;
  episodes.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (progress) progress(static_cast<double>(i) / static_cast<double>(count));
    Result<PointNavEpisode> e = generate_episode(navmesh, rng, rules);
    if (!e) return e.status();
    e->id = std::to_string(i);
    episodes.push_back(std::move(*e));
  }
  return episodes;
}

}  // namespace gsnav
