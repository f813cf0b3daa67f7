// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav_test {

/// Pairs of moving capsules in float.
struct CapsulePairs {
  std::vector<gsnav::MovingCapsule<float>> agents, bodies;

  void add(const gsnav::MovingCapsule<float>& a, const gsnav::MovingCapsule<float>& b) {
    agents.push_back(a);
    bodies.push_back(b);
  }
};

template <class S>
gsnav::MovingCapsule<S> cast_motion(const gsnav::MovingCapsule<float>& m) {
  const auto cast = [](const gsnav::Capsule<float>& c) {
    return gsnav::Capsule<S>{gsnav::vec_cast<S>(c.p0), gsnav::vec_cast<S>(c.p1),
                             static_cast<S>(c.radius)};
  };
  return {cast(m.begin), cast(m.end)};
}

/// Agents and limbs that meet, pass, overlap at the start or stay apart; some with 50 m of motion.
inline CapsulePairs random_pairs(std::uint64_t seed, std::size_t n) {
  gsnav::Rng rng(seed);
  CapsulePairs pairs;
  const auto in_box = [&](double size) {
    return gsnav::Vec3f{static_cast<float>(rng.uniform(-size, size)),
                        static_cast<float>(rng.uniform(-size, size)),
                        static_cast<float>(rng.uniform(-size, size))};
  };
  for (std::size_t i = 0; i < n; ++i) {
    const gsnav::Vec3f step = in_box(i % 7 == 0 ? 50 : 0.5),
                       up{0, static_cast<float>(rng.uniform(0, 1.5)), 0};
    const gsnav::Vec3f bone = in_box(0.3), at = in_box(1), drift = in_box(i % 5 == 0 ? 20 : 0.3),
                       turn = in_box(0.2);
    const float r = static_cast<float>(rng.uniform(0, 0.3)),
                r0 = static_cast<float>(rng.uniform(0, 0.2)),
                r1 = i % 3 == 0 ? r0 : static_cast<float>(rng.uniform(0, 0.2));
    pairs.add({{{}, up, r}, {step, step + up, r}},
              {{at, at + bone, r0}, {at + drift, at + drift + bone + turn, r1}});
  }
  return pairs;
}

/// Points, parallels, crossings, contact at the start, no motion, great speed, tiny and huge numbers,
/// NaN; each pair with each other motion.
inline CapsulePairs hard_pairs() {
  using V = gsnav::Vec3f;
  constexpr float tiny = std::numeric_limits<float>::min(),
                  nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<gsnav::Capsule<float>> shapes{
      {{0, 0, 0}, {0, 1, 0}, 0.1f},       {{0, 0, 0}, {0, 0, 0}, 0.0f},
      {{0, 0, 0}, {0, 0, 0}, 0.2f},       {{0, 0.5f, 0}, {0, 2, 0}, 0.1f},
      {{0.2f, 0, 0}, {0.2f, 1, 0}, 0.1f}, {{0.2f, 0, 0}, {0.2f, 1, 1e-6f}, 0.1f},
      {{-1, 0.5f, 0}, {1, 0.5f, 0}, 0},   {{0.3f, 0, 0}, {1, 0, 0}, 0.1f},
      {{tiny, 0, 0}, {0, tiny, 0}, tiny}, {{1e6f, 0, 0}, {1e6f, 1, 0}, 0.1f},
      {{nan, 0, 0}, {0, 1, 0}, 0.1f},     {{0.20005f, 0, 0}, {0.20005f, 1, 0}, 0.1f},
      {{0, 1e-30f, 0}, {1e-30f, 0, 0}, 0}};
  const std::vector<V> motions{{0, 0, 0},     {1, 0, 0},           {-1, 0, 0},
                               {0, 0.25f, 0}, {0.1f, 0.2f, -0.3f}, {100, 0, 0},
                               {0, 0, 1e-7f}, {-1e4f, 1e4f, 0},    {tiny, 0, tiny}};
  CapsulePairs pairs;
  for (const auto& a : shapes) {
    for (const auto& b : shapes) {
      for (std::size_t m = 0; m < motions.size() * motions.size(); ++m) {
        const V u = motions[m / motions.size()], v = motions[m % motions.size()];
        pairs.add({a, {a.p0 + u, a.p1 + u, a.radius}},
                  {b, {b.p0 + v, b.p1 + v * 0.5f, b.radius + (m % 3 == 0 ? 0.05f : 0.0f)}});
      }
    }
  }
  return pairs;
}

}  // namespace gsnav_test
