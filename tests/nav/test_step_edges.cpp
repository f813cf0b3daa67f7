// SPDX-License-Identifier: Apache-2.0
// Steps at the edges of what they promise: no surface, no polygon, nobody there, rough floors,
// kilometres.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/detail/core/small_vector.hpp"
#include "io/allocations.hpp"
#include "step_oracle.hpp"
#include "support/random_cases.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A floor of random hills that climbs and falls by up to 40 degrees, 20 m by 20 m, in triangles of half
/// a metre.
Soup hills(std::uint64_t seed) {
  Soup soup;
  Rng rng(seed);
  constexpr std::uint32_t kPosts = 41;
  std::vector<double> heights;
  for (std::uint32_t i = 0; i < kPosts * kPosts; ++i) heights.push_back(rng.uniform(0, 0.3));
  for (std::uint32_t r = 0; r < kPosts; ++r) {
    for (std::uint32_t c = 0; c < kPosts; ++c)
      soup.vertices.push_back({0.5 * c, heights[kPosts * r + c], 0.5 * r});
  }
  for (std::uint32_t r = 0; r + 1 < kPosts; ++r) {
    for (std::uint32_t c = 0; c + 1 < kPosts; ++c) {
      const std::uint32_t a = kPosts * r + c;
      soup.triangles.push_back({a, a + kPosts, a + kPosts + 1});
      soup.triangles.push_back({a, a + kPosts + 1, a + 1});
    }
  }
  return soup;
}

}  // namespace

TEST_CASE("step: from a valid start it ends on a polygon, whatever is in the way") {
  const NavMesh mesh = room();
  Rng rng(71);
  const Capsule<double> post{{0.15, 0.1, 0}, {0.15, 1.7, 0}, 0.2};
  const CapsuleSet around = CapsuleSet::standing(std::span(&post, 1)).value();
  int overlapping = 0;
  for (int i = 0; i < cases(3000); ++i) {
    AgentState agent = agent_at(rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4));
    agent.position.y = rng.uniform(-0.1, 0.1);  // a little off the surface
    StepOptions options;
    options.slide = i % 2 == 0;
    options.compat = i % 5 == 0 ? StepCompat::habitat_gs : StepCompat::none;
    const Vec3d asked = i % 3 == 0 ? Vec3d{} : heading(rng, rng.uniform(0, 0.5));
    const StepResult r = step(mesh, agent, asked, i % 4 == 0 ? CapsuleSet() : around, options);
    REQUIRE(r.blocked_by != BlockedBy::invalid);
    REQUIRE(r.poly < mesh.polygon_count());
    REQUIRE(mesh.island_of(r.poly) == 0);
    for (const WalkPoint& p : r.path) REQUIRE(p.poly < mesh.polygon_count());
    overlapping += r.started_overlapping ? 1 : 0;
  }
  CHECK(overlapping > cases(3000) / 10);
}

TEST_CASE("step: of zero length it says whether there is a surface below the agent") {
  const NavMesh mesh = room();
  CHECK(step(mesh, agent_at(1, 2), {}, {}).blocked_by == BlockedBy::none);
  CHECK(step(mesh, agent_at(1, 2), {}, {}).position == Vec3d{1, 0, 2});
  CHECK(step(mesh, agent_at(1, 2), {0, 1, 0}, {}).fraction == 1);
  for (const Vec3d& off : {Vec3d{1e6, 0, 0}, Vec3d{0, 50, 0}, Vec3d{112, 0, 0}}) {
    AgentState agent = agent_at(0, 0);
    agent.position = off;
    const StepResult r = step(mesh, agent, {}, {});
    CHECK(r.blocked_by == BlockedBy::invalid);
    CHECK(r.position == off);
    CHECK(step(mesh, agent, {0.1, 0, 0}, {}).blocked_by == BlockedBy::invalid);
    CHECK(is_step_blocked(mesh, agent, {}, {}));
  }
}

TEST_CASE("walk: every leg, and where a step ends, is within a centimetre of the surface") {
  double worst = 0, worst_end = 0;
  for (const std::uint64_t seed : {1u, 2u}) {
    const Soup soup = hills(seed);
    NavMeshSettings s;
    s.cell_size = 0.1;
    s.detail_sample_dist = seed == 1 ? 2 : 6;
    const NavMesh mesh = NavMesh::build(s, soup.vertices, soup.triangles).value();
    Rng rng(72);
    for (int i = 0; i < cases(4000); ++i) {
      const NavPoint start = mesh.random_point(rng, 0);
      const Vec3d go = heading(rng, i % 2 == 0 ? 0.25 : rng.uniform(0, 4));
      const SurfaceWalk w = mesh.walk(start, go, true);
      double length = 0;
      for (std::size_t k = 1; k < w.points.size(); ++k) {
        const WalkPoint &a = w.points[k - 1], &b = w.points[k];
        length += norm(b.position - a.position);
        REQUIRE(b.fraction >= a.fraction);
        for (int j = 1; j < 32; ++j) {
          const Vec3d p = lerp(a.position, b.position, j / 32.0);
          worst = std::max(worst, std::abs(mesh.height_at(b.poly, p) - p.y));
        }
      }
      CHECK(w.length == doctest::Approx(length));
      // Stopped by a body somewhere on the way.
      const Vec3d ahead = start.position + go * rng.uniform(0.4, 1.2);
      const Capsule<double> post{ahead, ahead + Vec3d{0, 1.5, 0}, 0.05};
      const AgentState agent{start.position, 0.1, 1.5, start.poly};
      const StepResult r = step(mesh, agent, go, CapsuleSet::standing(std::span(&post, 1)).value());
      worst_end = std::max(worst_end, std::abs(mesh.height_at(r.poly, r.position) - r.position.y));
    }
  }
  MESSAGE("legs leave the surface by " << worst << " m at most, ends by " << worst_end);
  CHECK(worst <= 0.01 + 1e-6);
  CHECK(worst_end <= 0.01 + 1e-6);
}

TEST_CASE("step: where nobody is near it allocates nothing, and has the bits of a step among nobody") {
  Soup soup;
  soup.floor(0, 0, 20, 20);
  const NavMesh mesh = NavMesh::build({}, soup.vertices, soup.triangles).value();
  const Capsule<double> far{{15, 0.1, 15}, {15, 1.7, 15}, 0.2};
  const CapsuleSet bodies = CapsuleSet::standing(std::span(&far, 1)).value(), nobody;
  Rng rng(74);
  for (int i = 0; i < 500; ++i) {
    const double x = rng.uniform(1, 8), z = rng.uniform(1, 8);
    const auto at = mesh.snap_point({x, 0, z}).value();
    const AgentState agent{at.position, 0.1, 1.5, at.poly};
    const Vec3d go = heading(rng, 0.25);
    reset_largest_allocation();
    const StepResult r = step(mesh, agent, go, bodies);
    REQUIRE(largest_allocation() == 0);
    const StepResult alone = step(mesh, agent, go, nobody);
    REQUIRE(r.position == alone.position);
    REQUIRE(r.path.size() == alone.path.size());
    REQUIRE(r.blocked_by == alone.blocked_by);
  }
}

TEST_CASE("small vector: the same as a vector, in the object and beyond it") {
  Rng rng(75);
  for (int round = 0; round < 200; ++round) {
    SmallVector<int, 4> a;
    std::vector<int> b;
    for (std::uint64_t n = rng.below(12); n-- > 0;) {
      a.push_back(static_cast<int>(rng.below(100)));
      b.push_back(a.back());
    }
    if (!a.empty() && round % 3 == 0) {
      a.push_back(a.front());  // one of its own
      b.push_back(b[0]);
    }
    const auto same = [&](const SmallVector<int, 4>& v) {
      return std::equal(v.begin(), v.end(), b.begin(), b.end());
    };
    SmallVector<int, 4> copy = a, assigned{1, 2, 3, 4, 5, 6};
    REQUIRE(same(copy));
    assigned = a;
    REQUIRE(same(assigned));
    SmallVector<int, 4> moved = std::move(copy);
    REQUIRE(same(moved));
    REQUIRE(copy.empty());  // NOLINT: what it is after that is said
    copy.push_back(7);
    REQUIRE(copy.back() == 7);
    assigned = std::move(moved);
    REQUIRE(same(assigned));
    a.clear();
    REQUIRE(a.empty());
    a = {1, 2};
    REQUIRE(a.size() == 2);
    REQUIRE(a[1] == 2);
  }
}
