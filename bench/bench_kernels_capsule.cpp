// SPDX-License-Identifier: Apache-2.0
// Kernels of agents among people: capsule distance, time of impact.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gsnav/kernels/capsule.hpp"
#include "gsnav/ops/sweep.hpp"
#include "kernel_bench.hpp"
#include "native_lanes.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

constexpr std::size_t kPairs = 4096;

/// Agents and limbs within two metres, both moving for one step.
struct CapsulePairs {
  std::vector<MovingCapsule<double>> agents, bodies;
  CapsulePairs() {
    Rng rng(5);
    for (std::size_t i = 0; i < kPairs; ++i) {
      const Vec3d base{rng.uniform(-1, 1), 0, rng.uniform(-1, 1)};
      const double yaw = rng.uniform(0, 6.28);
      const Vec3d move{0.25 * std::cos(yaw), 0, 0.25 * std::sin(yaw)};
      const Capsule<double> a{base + Vec3d{0, 0.1, 0}, base + Vec3d{0, 1.4, 0}, 0.1};
      agents.push_back({a, {a.p0 + move, a.p1 + move, 0.1}});
      const Vec3d p{rng.uniform(-1, 1), rng.uniform(0, 1.7), rng.uniform(-1, 1)};
      const Vec3d q = p + Vec3d{0.3 * rng.normal(), 0.3 * rng.normal(), 0.3 * rng.normal()};
      const Vec3d v{0.2 * rng.normal(), 0, 0.2 * rng.normal()};
      bodies.push_back({{p, q, 0.08}, {p + v, q + v, 0.08}});
    }
  }
};

template <class S>
std::vector<MovingCapsule<S>> converted(const std::vector<MovingCapsule<double>>& capsules) {
  const auto convert = [](const Capsule<double>& k) {
    return Capsule<S>{vec_cast<S>(k.p0), vec_cast<S>(k.p1), static_cast<S>(k.radius)};
  };
  std::vector<MovingCapsule<S>> out;
  for (const auto& m : capsules) out.push_back({convert(m.begin), convert(m.end)});
  return out;
}

/// The pairs in float, by planes.
struct PairPlanes {
  std::vector<float> values;
  const float* planes[kCapsulePlanes];

  explicit PairPlanes(const CapsulePairs& pairs) : values(kCapsulePlanes * kPairs) {
    for (std::size_t k = 0; k < kCapsulePlanes; ++k) planes[k] = values.data() + k * kPairs;
    for (std::size_t i = 0; i < kPairs; ++i) {
      const MovingCapsule<double>&a = pairs.agents[i], &b = pairs.bodies[i];
      std::size_t k = 0;
      const auto put = [&](double v) { values[k++ * kPairs + i] = static_cast<float>(v); };
      for (const Capsule<double>* c : {&a.begin, &a.end, &b.begin, &b.end}) {
        for (const Vec3d* p : {&c->p0, &c->p1}) {
          put(p->x);
          put(p->y);
          put(p->z);
        }
        put(c->radius);
      }
    }
  }
};

/// Distance or time of impact in lanes; counts the pairs whose bits are not those of one pair alone.
struct LanesBody {
  bool moving;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const CapsulePairs pairs;
    const PairPlanes input(pairs);
    std::vector<float> out(kPairs);
    constexpr std::size_t kPiece = 128;
    for (auto _ : state) {
      backend.parallel_for(kPairs / kPiece, [&](std::size_t p) {
        const auto kernel = moving ? native_sweep : native_gap;
        kernel(input.planes, out.data(), p * kPiece, (p + 1) * kPiece);
      });
      benchmark::ClobberMemory();
    }
    count(state, kPairs);
    const auto a = converted<float>(pairs.agents), b = converted<float>(pairs.bodies);
    double differ = 0;
    for (std::size_t i = 0; i < kPairs; ++i) {
      const float one = moving ? sweep(a[i], b[i], SweepRules<float>{}).time : capsule_gap(a[i].begin, b[i].begin).gap;
      differ += bits_of(out[i]) != bits_of(one) ? 1 : 0;
    }
    state.counters["lanes_differ"] = differ;
  }
};

struct DistanceBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const CapsulePairs pairs;
    const auto a = converted<S>(pairs.agents), b = converted<S>(pairs.bodies);
    std::vector<S> gaps(kPairs);
    time_items(state, backend, kPairs, [a = a.data(), b = b.data(), out = gaps.data()](std::size_t i) {
      out[i] = capsule_gap(a[i].begin, b[i].begin).gap;
    });
    std::vector<double> truth;
    for (std::size_t i = 0; i < kPairs; ++i) {
      truth.push_back(capsule_gap(pairs.agents[i].begin, pairs.bodies[i].begin).gap);
    }
    state.counters["gap_max_m"] = error_of(gaps, truth).max;
  }
};

struct SweepBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const CapsulePairs pairs;
    const auto a = converted<S>(pairs.agents), b = converted<S>(pairs.bodies);
    std::vector<S> times(kPairs);
    time_items(state, backend, kPairs, [a = a.data(), b = b.data(), out = times.data()](std::size_t i) {
      out[i] = sweep(a[i], b[i], SweepRules<S>{}).time;
    });
    // What the agent reaches by the reported time, in double: an overlap that was not there before, and how
    // far it rests from where the sweep in double leaves it.
    double deepest = 0, travel = 0;
    for (std::size_t i = 0; i < kPairs; ++i) {
      const double time = static_cast<double>(times[i]);
      const auto at = [&](const MovingCapsule<double>& m) { return lerp(m.begin, m.end, time); };
      if (capsule_gap(pairs.agents[i].begin, pairs.bodies[i].begin).gap < 1e-4) continue;
      deepest = std::max(deepest, -capsule_gap(at(pairs.agents[i]), at(pairs.bodies[i])).gap);
      const double truth = sweep(pairs.agents[i], pairs.bodies[i], SweepRules<double>{}).time;
      travel = std::max(travel, std::abs(time - truth) * 0.25);
    }
    state.counters["overlap_max_m"] = deepest;
    state.counters["travel_max_m"] = travel;
  }
};

/// One agent's step against all limbs of a crowd, as an environment does it. Items are limbs.
struct CrowdBody {
  std::size_t people;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kBones = 20, kAgents = 64;
    const CapsulePairs pairs;
    std::vector<DynamicCapsule> limbs;
    Rng rng(17);
    for (std::size_t p = 0; p < people; ++p) {
      const Vec3d at{rng.uniform(-4, 4), 0, rng.uniform(-4, 4)};
      for (std::size_t k = 0; k < kBones; ++k) {
        MovingCapsule<double> m = pairs.bodies[p * kBones + k];
        for (Capsule<double>* c : {&m.begin, &m.end}) {
          c->p0 = c->p0 + at;
          c->p1 = c->p1 + at;
        }
        limbs.push_back({m, static_cast<std::uint32_t>(p), static_cast<std::uint32_t>(k)});
      }
    }
    const View<const DynamicCapsule> bodies{limbs.data(), limbs.size()};
    const auto impact = [&]<class T>(std::size_t i) {
      FirstImpact<T> best;
      first_impact<T>(pairs.agents[i], bodies, 0.0, 1.0, SweepRules<T>{}, best);
      return best.hit ? static_cast<double>(best.sweep.time) : 1.0;
    };
    std::vector<double> times(kAgents), truth(kAgents);
    for (auto _ : state) {
      backend.parallel_for(kAgents, [&](std::size_t i) { times[i] = impact.template operator()<S>(i); });
      benchmark::ClobberMemory();
    }
    count(state, kAgents * limbs.size());
    for (std::size_t i = 0; i < kAgents; ++i) truth[i] = impact.template operator()<double>(i);
    state.counters["travel_max_m"] = 0.25 * error_of(times, truth).max;
  }
};

}  // namespace

void register_capsule_kernels() {
  const std::string lanes = "float x" + std::to_string(native_width());
  add_cpu_rows("capsule_distance", "", DistanceBody{});
  add_openmp_rows("capsule_distance", "", lanes, LanesBody{false});
  add_cpu_rows("capsule_sweep", "", SweepBody{});
  add_openmp_rows("capsule_sweep", "", lanes, LanesBody{true});
  add_cpu_rows("first_impact", "people:10", CrowdBody{10});
}

}  // namespace gsnav_bench
