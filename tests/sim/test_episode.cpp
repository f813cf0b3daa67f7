// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/sim/episode.hpp"

using namespace gsnav;

namespace {
const NavMesh& flat() {
  static const NavMesh mesh = [] {
    const DefaultScene scene = make_default_scene(0.05).value();
    return NavMesh::build({}, scene.vertices, scene.triangles).value();
  }();
  return mesh;
}
}  // namespace

TEST_CASE("generated episodes keep the rules") {
  const EpisodeRules rules;
  const auto episodes = generate_episodes(flat(), 200, 7).value();
  REQUIRE(episodes.size() == 200);
  std::size_t straight = 0;
  for (const PointNavEpisode& e : episodes) {
    const double d = flat().geodesic_distance(e.start_position, e.goal_position);
    CHECK(d == e.geodesic_distance);
    CHECK(d >= rules.min_distance);
    CHECK(d <= rules.max_distance);
    CHECK(abs(e.start_position.y - e.goal_position.y) <= rules.max_height_difference);
    const auto at = flat().snap_point(e.start_position), goal = flat().snap_point(e.goal_position);
    REQUIRE((at && goal));
    CHECK(flat().island_of(at->poly) == flat().island_of(goal->poly));
    CHECK(flat().island_radius(flat().island_of(at->poly)) >= rules.min_island_radius);
    CHECK(e.start_rotation.x == 0.0);
    CHECK(e.start_rotation.z == 0.0);
    CHECK(dot(e.start_rotation, e.start_rotation) == doctest::Approx(1.0));
    straight += d / norm(e.goal_position - e.start_position) < rules.straight_ratio ? 1 : 0;
  }
  // A straight path is kept with probability 0.008 to 0.288.
  CHECK(straight < 120);
  CHECK(straight > 0);
}

TEST_CASE("episodes are decided by the seed") {
  const auto a = generate_episodes(flat(), 20, 3).value(), b = generate_episodes(flat(), 20, 3).value();
  const auto c = generate_episodes(flat(), 20, 4).value();
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a[i].start_position == b[i].start_position);
    CHECK(a[i].goal_position == b[i].goal_position);
    CHECK(a[i].start_rotation.w == b[i].start_rotation.w);
    CHECK(a[i].id == std::to_string(i));
  }
  CHECK_FALSE(a[0].start_position == c[0].start_position);
}

TEST_CASE("episodes that cannot be are refused") {
  EpisodeRules rules;
  rules.min_distance = 29.0;
  rules.max_goals = 20;
  CHECK(generate_episodes(flat(), 1, 1, rules).code() == Errc::nothing_navigable);
  rules = {};
  rules.min_island_radius = 100.0;
  CHECK(generate_episodes(flat(), 1, 1, rules).code() == Errc::nothing_navigable);
  rules = {};
  rules.max_distance = 0.5;
  const auto e = generate_episodes(flat(), 1, 1, rules);
  CHECK(e.code() == Errc::invalid_argument);
  CHECK(e.message().find("max_distance") != std::string::npos);
  rules = {};
  rules.retries_per_goal = 0;
  CHECK(validate(rules).message().find("retries_per_goal") != std::string::npos);
  rules.retries_per_goal = 1001;
  rules.max_goals = 1000;
  CHECK(validate(rules).message().find("max_goals = 1000: times retries_per_goal") != std::string::npos);
  rules.retries_per_goal = 1000;
  CHECK(validate(rules));
  const auto many = generate_episodes(flat(), 10'000'001, 1);
  CHECK(many.code() == Errc::invalid_argument);
  CHECK(many.message().find("count = 10000001: must be in [0, 10000000]") != std::string::npos);
}
