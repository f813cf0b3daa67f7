// SPDX-License-Identifier: Apache-2.0
// Kernels for agents among people: capsule distance and time of impact.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#if defined(GSNAV_HAS_FCL)
#include "fcl_capsules.hpp"
#endif
#include "gsnav/sweep/sweep.hpp"
#include "kernel_bench.hpp"

using namespace gsnav;

namespace gsnav_bench {

namespace {

constexpr std::size_t kPairs = 100000;

/// Pairs of an agent and a limb: the agent moves by a step of 0.25 m, the limb meanwhile translates by
/// up to 0.3 m.
struct CapsulePairs {
  std::vector<MovingCapsule<double>> agents, bodies;

  /// Limbs anywhere within 3 m to each side. About one in some hundred of the pairs that start apart
  /// meets.
  static const CapsulePairs& mixed() {
    static const CapsulePairs pairs(3.0, 0.25, false);
    return pairs;
  }
  static const CapsulePairs& meeting() {
    static const CapsulePairs pairs(1.5, 1.0, true);
    return pairs;
  }

 private:
  CapsulePairs(double size, double step, bool all_meet) {
    Rng rng(5);
    // Values that a float holds exactly, so that all scalar types get the same pairs.
    const auto near_float = [](const Vec3d& v) { return vec_cast<double>(vec_cast<float>(v)); };
    const auto motion = [&](const Vec3d& p, const Vec3d& q, double r, const Vec3d& move) {
      const auto capsule = [&](const Vec3d& by) {
        return Capsule<double>{near_float(p + by), near_float(q + by),
                               static_cast<double>(static_cast<float>(r))};
      };
      return MovingCapsule<double>{capsule({}), capsule(move)};
    };
    while (agents.size() < kPairs) {
      const double yaw = rng.uniform(0, 6.28), radius = rng.uniform(0.1, 0.3);
      const Vec3d up{0, rng.uniform(0.6, 1.8) - 2 * radius, 0}, base{0, radius, 0};
      const auto a = motion(base, base + up, radius, Vec3d{std::cos(yaw), 0, std::sin(yaw)} * step);
      const Vec3d at{rng.uniform(-size, size), rng.uniform(0, 1.7), rng.uniform(-size, size)};
      const Vec3d limb{0.2 * rng.normal(), 0.2 * rng.normal(), 0.2 * rng.normal()};
      const Vec3d drift =
          normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()}) * rng.uniform(0, 0.3);
      const auto b = motion(at, at + limb, rng.uniform(0.03, 0.15), drift);
      if (all_meet) {
        const SweepResult<double> r = sweep(a, b, SweepRules<double>{});
        if (!r.hit || r.start_gap < 1e-3) continue;
      }
      agents.push_back(a);
      bodies.push_back(b);
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

/// Moving capsules by planes: one array per coordinate and radius.
template <class S>
class MotionPlanes {
 public:
  explicit MotionPlanes(const std::vector<MovingCapsule<double>>& m) : n_(m.size()), values_(14 * n_) {
    for (std::size_t i = 0; i < n_; ++i) {
      std::size_t k = 0;
      const auto put = [&](double v) { values_[k++ * n_ + i] = static_cast<S>(v); };
      for (const Capsule<double>* c : {&m[i].begin, &m[i].end}) {
        for (const Vec3d* p : {&c->p0, &c->p1}) {
          put(p->x);
          put(p->y);
          put(p->z);
        }
        put(c->radius);
      }
    }
  }
  MovingCapsulePlanes<S> view() const { return {capsules(0), capsules(7)}; }

 private:
  View<const S> plane(std::size_t k) const { return {values_.data() + k * n_, n_}; }
  CapsulePlanes<S> capsules(std::size_t k) const {
    return {{plane(k), plane(k + 1), plane(k + 2)},
            {plane(k + 3), plane(k + 4), plane(k + 5)},
            plane(k + 6)};
  }
  std::size_t n_;
  std::vector<S> values_;
};

/// Time of FCL for one pair on one thread, ns: the median of some runs over a part of the pairs. It is
/// measured in the same process as our row. 0 without FCL.
[[maybe_unused]] double fcl_ns([[maybe_unused]] const CapsulePairs& pairs,
                               [[maybe_unused]] bool moving) {
#if defined(GSNAV_HAS_FCL)
  constexpr std::size_t kSome = 10000;
  const FclPairs fcl(pairs.agents, pairs.bodies);
  std::vector<double> times;
  for (int run = 0; run < 9; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    double sum = 0;
    for (std::size_t i = 0; i < kSome; ++i) sum += moving ? fcl.contact(i) : fcl.distance(i);
    benchmark::DoNotOptimize(sum);
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4] / kSome;
#else
  return 0;
#endif
}

/// Adds FCL's time per pair on one thread, and how many times as fast our row is.
void compare_with_fcl(benchmark::State& state, const CapsulePairs& pairs, bool moving) {
  const double ns = fcl_ns(pairs, moving);
  if (ns == 0) return;
  state.counters["fcl_ns"] = ns;
  state.counters["x_fcl"] =
      benchmark::Counter(ns * 1e-9 * kPairs, benchmark::Counter::kIsIterationInvariantRate);
}

/// Distances of a batch of pairs. Errors are against double: absolute, and those of the distance between
/// the axes relative to that distance or 1 cm, whichever is larger.
struct DistanceBody {
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const CapsulePairs& pairs = CapsulePairs::mixed();
    const MotionPlanes<S> a(pairs.agents), b(pairs.bodies);
    std::vector<S> gaps(kPairs);
    CapsuleGapArgs<S> args;
    args.a = a.view().begin;
    args.b = b.view().begin;
    args.gap = view_of(gaps);
    for (auto _ : state) {
      capsule_gaps(backend, args).throw_if_error();
      benchmark::ClobberMemory();
    }
    count(state, kPairs);
    double absolute = 0, relative = 0, differ = 0;
    const auto alone_a = converted<S>(pairs.agents), alone_b = converted<S>(pairs.bodies);
    for (std::size_t i = 0; i < kPairs; ++i) {
      const Capsule<double>&u = pairs.agents[i].begin, &v = pairs.bodies[i].begin;
      const double distance = segment_distance(u.p0, u.p1, v.p0, v.p1).distance;
      const double error = std::abs(static_cast<double>(gaps[i]) - (distance - u.radius - v.radius));
      absolute = std::max(absolute, error);
      relative = std::max(relative, error / std::max(distance, 0.01));
      differ += gaps[i] == capsule_gap(alone_a[i].begin, alone_b[i].begin).gap ? 0 : 1;
    }
    state.counters["gap_max_m"] = absolute;
    state.counters["gap_rel_max"] = relative;
    state.counters["differ"] = differ;  // pairs whose result differs from that of one pair alone
    compare_with_fcl(state, pairs, false);
  }
};

/// Sweeps of a batch of pairs. Errors are computed in double: the depth to which an agent that started
/// free enters a limb by the reported time, and the number of pairs whose outcome is not the one in
/// double.
struct SweepBody {
  bool all_meet;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    const CapsulePairs& pairs = all_meet ? CapsulePairs::meeting() : CapsulePairs::mixed();
    const MotionPlanes<S> a(pairs.agents), b(pairs.bodies);
    std::vector<S> times(kPairs), start_gaps(kPairs);
    std::vector<std::uint8_t> outcomes(kPairs);
    SweepArgs<S> args;
    args.agents = a.view();
    args.bodies = b.view();
    args.time = view_of(times);
    args.start_gap = view_of(start_gaps);
    args.outcome = view_of(outcomes);
    for (auto _ : state) {
      sweep_capsules(backend, args).throw_if_error();
      benchmark::ClobberMemory();
    }
    count(state, kPairs);
    double deepest = -1, hits = 0, other_class = 0, differ = 0;
    const auto alone_a = converted<S>(pairs.agents), alone_b = converted<S>(pairs.bodies);
    for (std::size_t i = 0; i < kPairs; ++i) {
      const MovingCapsule<double>&u = pairs.agents[i], &v = pairs.bodies[i];
      const bool hit = (outcomes[i] & kSweepHit) != 0;
      differ += times[i] == sweep(alone_a[i], alone_b[i], SweepRules<S>{}).time ? 0 : 1;
      hits += hit ? 1 : 0;
      other_class += hit == sweep(u, v, SweepRules<double>{}).hit ? 0 : 1;
      if (capsule_gap(u.begin, v.begin).gap < 1e-4) continue;
      const double t = static_cast<double>(times[i]);
      deepest = std::max(deepest, -capsule_gap(lerp(u.begin, u.end, t), lerp(v.begin, v.end, t)).gap);
    }
    state.counters["hits"] = hits;
    state.counters["other_class"] = other_class;
    state.counters["overlap_max_m"] = deepest;
    state.counters["differ"] = differ;
    compare_with_fcl(state, pairs, true);
  }
};

#if defined(GSNAV_HAS_FCL)
/// FCL on the mixed pairs: the errors of its distances against our kernel in double, and its missed
/// contacts.
void fcl_row(benchmark::State& state, bool moving, bool all_meet) {
  const CapsulePairs& pairs = all_meet ? CapsulePairs::meeting() : CapsulePairs::mixed();
  constexpr std::size_t kSome = 20000;
  const FclPairs fcl(pairs.agents, pairs.bodies);
  for (auto _ : state) {
    double sum = 0;
    for (std::size_t i = 0; i < kSome; ++i) sum += moving ? fcl.contact(i) : fcl.distance(i);
    benchmark::DoNotOptimize(sum);
  }
  count(state, kSome);
  double error = 0, other_class = 0;
  for (std::size_t i = 0; i < kSome; ++i) {
    const double gap = capsule_gap(pairs.agents[i].begin, pairs.bodies[i].begin).gap;
    if (gap < 1e-4) continue;
    if (moving) {
      const bool hit = sweep(pairs.agents[i], pairs.bodies[i], SweepRules<double>{}).hit;
      other_class += hit == (fcl.contact(i) <= 1) ? 0 : 1;
    } else {
      error = std::max(error, std::abs(fcl.distance(i) - gap));
    }
  }
  state.counters[moving ? "other_class" : "gap_max_m"] = moving ? other_class : error;
}
#endif

/// One agent's step against all limbs of a crowd, as an environment computes it. Items are limbs.
struct CrowdBody {
  std::size_t people;
  template <class S, class B>
  void operator()(benchmark::State& state, B& backend) const {
    constexpr std::size_t kBones = 20, kAgents = 64;
    const CapsulePairs& pairs = CapsulePairs::mixed();
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
#if defined(GSNAV_HAS_FCL)
  const auto fcl = [](const char* name, bool moving, bool all_meet) {
    benchmark::RegisterBenchmark(name,
                                 [=](benchmark::State& state) { fcl_row(state, moving, all_meet); })
        ->Unit(benchmark::kMicrosecond)
        ->UseRealTime();
  };
  fcl("capsule_distance<double, FCL>", false, false);
  fcl("capsule_sweep<double, FCL>/mixed", true, false);
  fcl("capsule_sweep<double, FCL>/meeting", true, true);
#endif
  add_cpu_rows("capsule_distance", "", DistanceBody{});
  add_cpu_rows("capsule_sweep", "mixed", SweepBody{false});
  add_cpu_rows("capsule_sweep", "meeting", SweepBody{true});
  add_cpu_rows("first_impact", "people:10", CrowdBody{10});
}

}  // namespace gsnav_bench
