// SPDX-License-Identifier: Apache-2.0
// How near avatars come during a tick, against sampling it finely.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/sim/proximity.hpp"
#include "gsnav/sim/metrics.hpp"

using namespace gsnav;

namespace {

/// Distance of two segments by sampling both: above the truth by half a sample at most.
double segments(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1) {
  double best = 1e30;
  for (int i = 0; i <= 60; ++i) {
    const Vec3d p = lerp(a0, a1, i / 60.0);
    const Vec3d d = b1 - b0;
    const double t = dot(d, d) > 0 ? std::clamp(dot(p - b0, d) / dot(d, d), 0.0, 1.0) : 0.0;
    best = std::min(best, norm(p - lerp(b0, b1, t)));
  }
  return best;
}

}  // namespace

TEST_CASE("the least distance to each avatar is that of a fine sampling") {
  Rng rng(11);
  const auto somewhere = [&](double spread) {
    return Vec3d{rng.uniform(-spread, spread), rng.uniform(0.2, 1.7), rng.uniform(-spread, spread)};
  };
  int near = 0, bounds = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<DynamicCapsule> capsules;
    for (std::uint32_t avatar = 0; avatar < 3; ++avatar) {
      const Vec3d base = Vec3d{rng.uniform(-2.5, 2.5), 0, rng.uniform(-2.5, 2.5)};
      const Vec3d go{rng.uniform(-0.4, 0.4), 0, rng.uniform(-0.4, 0.4)};
      for (std::uint32_t bone = 0; bone < 6; ++bone) {
        const Vec3d a = base + somewhere(0.3), b = a + somewhere(0.2) - Vec3d{0, 0.9, 0},
                    turn = somewhere(0.1) - Vec3d{0, 0.9, 0};
        capsules.push_back({{{a, b, 0.08}, {a + go, b + go + turn * 0.2, 0.09}}, avatar, bone});
      }
    }
    const CapsuleSet set = CapsuleSet::create(capsules).value();
    const Vec3d start{0, 0, 0}, corner{rng.uniform(-0.3, 0.3), 0, 0.1},
        end = corner + Vec3d{0.1, 0, rng.uniform(-0.2, 0.2)};
    const std::vector<WalkPoint> path{{start, 0, 0.0}, {corner, 0, 0.4}, {end, 0, 0.9}};
    std::vector<double> out;
    closest_approach(path, 0.1, 1.5, set, out);
    REQUIRE(out.size() == 3);
    std::vector<double> truth(3, 1e30);
    for (int i = 0; i <= 400; ++i) {
      const double u = i / 400.0;
      const Vec3d at = u < 0.4   ? lerp(start, corner, u / 0.4)
                       : u < 0.9 ? lerp(corner, end, (u - 0.4) / 0.5)
                                 : end;
      for (const DynamicCapsule& c : set.capsules()) {
        const double r = 0.08 + 0.01 * u;
        const double d = segments(at + Vec3d{0, 0.1, 0}, at + Vec3d{0, 1.4, 0},
                                  lerp(c.motion.begin.p0, c.motion.end.p0, u),
                                  lerp(c.motion.begin.p1, c.motion.end.p1, u));
        truth[c.avatar] = std::min(truth[c.avatar], d - 0.1 - r);
      }
    }
    const double nearest = *std::min_element(truth.begin(), truth.end());
    for (std::size_t k = 0; k < 3; ++k) {
      CAPTURE(trial);
      CAPTURE(k);
      CHECK(out[k] < truth[k] + 0.01);
      if (truth[k] < max(kPersonalSpace, nearest + 1e-9)) {
        CHECK(out[k] > truth[k] - 0.01);
        ++near;
      } else {
        // A bound will do, but it must not come into personal space or before the nearest.
        CHECK(out[k] >= std::min(kPersonalSpace, truth[k]) - 0.01);
        CHECK(out[k] >= nearest - 0.01);
        ++bounds;
      }
      CHECK(std::abs(intrusion(out[k]) - intrusion(truth[k])) < 0.011);
    }
  }
  CHECK(near > 30);
  CHECK(bounds > 30);
}

TEST_CASE("nobody there") {
  std::vector<double> out(3);
  closest_approach({}, 0.1, 1.5, CapsuleSet(), out);
  CHECK(out.empty());
}

TEST_CASE("the smallest distance to each avatar is kept over ticks with other avatars") {
  Rng rng(13);
  std::map<std::uint32_t, double> truth;
  std::vector<std::uint32_t> avatars;
  std::vector<double> distances;
  for (int tick = 0; tick < 40; ++tick) {
    std::vector<DynamicCapsule> bodies;
    for (std::uint32_t avatar = 0; avatar < 12; ++avatar) {
      if (rng.below(3) == 0) continue;
      const Capsule<double> body{{1.0 * avatar, 0, 0}, {1.0 * avatar, 1, 0}, 0.2};
      bodies.push_back({{body, body}, avatar, 0});
    }
    const CapsuleSet set = CapsuleSet::create(bodies).value();
    std::vector<double> approach(set.groups().size());
    for (std::size_t g = 0; g < approach.size(); ++g) {
      approach[g] = rng.uniform(-1, 5);
      const auto avatar = set.capsules_of(set.groups()[g])[0].avatar;
      const auto [at, fresh] = truth.try_emplace(avatar, approach[g]);
      if (!fresh) at->second = std::min(at->second, approach[g]);
    }
    merge_distances(approach, set, avatars, distances);
    CHECK(avatars.size() == truth.size());
    CHECK(distances.size() == truth.size());
    std::size_t i = 0;
    for (const auto& [avatar, distance] : truth) {
      CHECK(avatars[i] == avatar);
      CHECK(distances[i++] == distance);
    }
  }
  CHECK(truth.size() == 12);
}

TEST_CASE("the least distance to the fastest bodies is found, too") {
  Rng rng(12);
  double worst = 0;
  int near = 0;
  const auto somewhere = [&](double spread) {
    const double x = rng.uniform(-spread, spread), y = rng.uniform(0.2, 1.7),
                 z = rng.uniform(-spread, spread);
    return Vec3d{x, y, z};
  };
  for (int trial = 0; trial < 300; ++trial) {
    // Limbs that go up to some 300 m in the tick, past the agent each at a time of its own, turning as
    // they go.
    const double far = trial % 4 == 0 ? 1.0 : 50.0;
    std::vector<DynamicCapsule> limbs;
    for (std::uint32_t k = 0; k < 4; ++k) {
      const Vec3d a = somewhere(far), b = a + somewhere(0.5) - Vec3d{0, 0.9, 0};
      const Vec3d to = a + (somewhere(1.2) - a) * (1 / rng.uniform(0.3, 0.95));
      const Vec3d end = to + somewhere(0.5) - Vec3d{0, 0.9, 0};
      limbs.push_back({{{a, b, 0.1}, {to, end, 0.2}}, 0, k});
    }
    const CapsuleSet set = CapsuleSet::create(limbs).value();
    const Vec3d corner{rng.uniform(-0.3, 0.3), 0, 0.1},
        last = corner + Vec3d{0.1, 0, rng.uniform(-0.2, 0.2)};
    const std::vector<WalkPoint> path{{{}, 0, 0.0}, {corner, 0, 0.4}, {last, 0, 0.9}};
    std::vector<double> out;
    closest_approach(path, 0.1, 1.5, set, out);
    double truth = 1e30, speed = 0;
    for (const DynamicCapsule& c : set.capsules()) {
      const Capsule<double>&m = c.motion.begin, &n = c.motion.end;
      const auto gap = [&](double u) {
        const Vec3d at = u < 0.4 ? lerp(Vec3d{}, corner, u / 0.4)
                                 : (u < 0.9 ? lerp(corner, last, (u - 0.4) / 0.5) : last);
        const double d = segments(at + Vec3d{0, 0.1, 0}, at + Vec3d{0, 1.4, 0}, lerp(m.p0, n.p0, u),
                                  lerp(m.p1, n.p1, u));
        return d - 0.1 - (0.1 + 0.1 * u);
      };
      // A gap changes no faster than both move: branch and bound to half a millimetre.
      const double fastest = std::max(norm(n.p0 - m.p0), norm(n.p1 - m.p1)) + 0.1 + 1.5;
      speed = std::max(speed, fastest);
      const auto search = [&](const auto& self, double u0, double g0, double u1, double g1) -> void {
        if (0.5 * (g0 + g1 - fastest * (u1 - u0)) > truth - 5e-4) return;
        const double um = 0.5 * (u0 + u1), gm = gap(um);
        truth = std::min(truth, gm);
        self(self, u0, g0, um, gm);
        self(self, um, gm, u1, g1);
      };
      truth = std::min(truth, std::min(gap(0), gap(1)));
      search(search, 0, gap(0), 1, gap(1));
    }
    if (truth > kPersonalSpace) continue;
    ++near;
    // One of the segments of the truth is sampled: it may be above by half a sample.
    CHECK(out[0] > truth - 0.013);
    CHECK(out[0] <= truth + 1e-6 + 1e-4 * speed);
    worst = std::max(worst, out[0] - truth);
  }
  MESSAGE(near << " come near; at most " << worst << " m too far");
  CHECK(near > 50);
}
