// SPDX-License-Identifier: Apache-2.0
// Many pairs of capsules at once: packs of every width and every backend give the bits of one pair
// alone.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gsnav/detail/math/pack.hpp"
#include "gsnav/sweep/sweep.hpp"
#include "ops/backends.hpp"
#include "ops/capsule_pairs.hpp"
#if defined(_OPENMP) && defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>
#endif
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#include "ops/no_gpu.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// The pairs by planes, and arrays for all that can be asked for.
template <class S, class B>
struct PairPlanes {
  explicit PairPlanes(B& b, const CapsulePairs& pairs) : backend(b), n(pairs.agents.size()) {
    const auto moving = [&](const std::vector<MovingCapsule<float>>& m) {
      const auto plane = [&](const auto& field) {
        std::vector<S> v;
        for (const auto& c : m) v.push_back(static_cast<S>(field(c)));
        return input(v);
      };
      MovingCapsulePlanes<S> out;
      for (int k = 0; k < 3; ++k) {
        out.begin.p0[k] = plane([k](const auto& c) { return c.begin.p0[k]; });
        out.begin.p1[k] = plane([k](const auto& c) { return c.begin.p1[k]; });
        out.end.p0[k] = plane([k](const auto& c) { return c.end.p0[k]; });
        out.end.p1[k] = plane([k](const auto& c) { return c.end.p1[k]; });
      }
      out.begin.radius = plane([](const auto& c) { return c.begin.radius; });
      out.end.radius = plane([](const auto& c) { return c.end.radius; });
      return out;
    };
    sweeps.agents = moving(pairs.agents);
    sweeps.bodies = moving(pairs.bodies);
    outcome.resize_discard(n);
    sweeps.outcome = outcome.view();
    for (View<S>* v : {&sweeps.time, &sweeps.start_gap, &sweeps.contact_time, &sweeps.gap, &gaps.gap})
      *v = output();
    for (int k = 0; k < 3; ++k) {
      for (View<S>* v :
           {&sweeps.normal[k], &sweeps.point[k], &gaps.normal[k], &gaps.on_a[k], &gaps.on_b[k]})
        *v = output();
    }
    gaps.a = sweeps.agents.begin;
    gaps.b = sweeps.bodies.begin;
  }
  View<const S> input(const std::vector<S>& v) {
    memory.emplace_back(backend).upload(v.data(), v.size());
    return {memory.back().data(), v.size()};
  }
  View<S> output() {
    memory.emplace_back(backend).resize_discard(n);
    return memory.back().view();
  }
  std::vector<S> fetch(const View<S>& view) {
    for (const auto& m : memory) {
      if (m.data() != view.data) continue;
      std::vector<S> v(view.size);
      m.download(v.data(), v.size());
      backend.synchronize().throw_if_error();
      return v;
    }
    return {};
  }
  std::vector<std::uint8_t> fetch_outcome() {
    std::vector<std::uint8_t> v(n);
    outcome.download(v.data(), n);
    backend.synchronize().throw_if_error();
    return v;
  }

  B& backend;
  std::size_t n;
  std::vector<Buffer<S, B>> memory;
  Buffer<std::uint8_t, B> outcome{backend};
  SweepArgs<S> sweeps;
  CapsuleGapArgs<S> gaps;
};

/// Equal, or both NaN.
template <class S>
bool same(S a, S b) {
  return a == b ? std::signbit(a) == std::signbit(b) : a != a && b != b;
}

/// Every value that a batch writes, against one pair after the other.
template <class S, class B>
void check_batch(B& backend, const CapsulePairs& pairs, const std::string& name) {
  CAPTURE(name);
  PairPlanes<S, B> p(backend, pairs);
  REQUIRE(capsule_gaps(backend, p.gaps).ok());
  REQUIRE(sweep_capsules(backend, p.sweeps).ok());
  const auto gap = p.fetch(p.gaps.gap), time = p.fetch(p.sweeps.time),
             start = p.fetch(p.sweeps.start_gap), contact = p.fetch(p.sweeps.contact_time),
             last = p.fetch(p.sweeps.gap);
  const auto outcome = p.fetch_outcome();
  std::vector<S> normal[3], on_a[3], on_b[3], sweep_normal[3], point[3];
  for (int k = 0; k < 3; ++k) {
    normal[k] = p.fetch(p.gaps.normal[k]);
    on_a[k] = p.fetch(p.gaps.on_a[k]);
    on_b[k] = p.fetch(p.gaps.on_b[k]);
    sweep_normal[k] = p.fetch(p.sweeps.normal[k]);
    point[k] = p.fetch(p.sweeps.point[k]);
  }
  std::size_t differ = 0;
  for (std::size_t i = 0; i < p.n; ++i) {
    const auto a = cast_motion<S>(pairs.agents[i]), b = cast_motion<S>(pairs.bodies[i]);
    const CapsuleGap<S> g = capsule_gap(a.begin, b.begin);
    const SweepResult<S> r = sweep(a, b, p.sweeps.rules);
    bool equal = same(gap[i], g.gap) && same(time[i], r.time) && same(start[i], r.start_gap) &&
                 same(contact[i], r.contact_time) && same(last[i], r.gap);
    equal = equal && ((outcome[i] & kSweepHit) != 0) == r.hit &&
            ((outcome[i] & kSweepPushed) != 0) == r.pushed &&
            ((outcome[i] & kSweepAgentClosing) != 0) == r.agent_closing;
    for (int k = 0; k < 3; ++k) {
      equal = equal && same(normal[k][i], g.normal[k]) && same(on_a[k][i], g.on_a[k]) &&
              same(on_b[k][i], g.on_b[k]) && same(sweep_normal[k][i], r.normal[k]) &&
              same(point[k][i], r.point[k]);
    }
    differ += equal ? 0 : 1;
  }
  CHECK(differ == 0);
  // Asked for less, the rest is the same.
  p.sweeps.contact_time = p.sweeps.gap = {};
  for (int k = 0; k < 3; ++k)
    p.sweeps.normal[k] = p.sweeps.point[k] = p.gaps.normal[k] = p.gaps.on_a[k] = p.gaps.on_b[k] = {};
  REQUIRE(capsule_gaps(backend, p.gaps).ok());
  REQUIRE(sweep_capsules(backend, p.sweeps).ok());
  const auto all_same = [](const std::vector<S>& a, const std::vector<S>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same<S>);
  };
  CHECK(all_same(p.fetch(p.gaps.gap), gap));
  CHECK(all_same(p.fetch(p.sweeps.time), time));
  CHECK(p.fetch_outcome() == outcome);
}

/// A pack of N pairs, field by field, against each alone.
template <int N>
std::size_t differing_packs(const CapsulePairs& pairs) {
  using P = Pack<float, N>;
  std::size_t differ = 0;
  for (std::size_t first = 0; first + N <= pairs.agents.size(); first += N) {
    const auto gather = [&](const std::vector<MovingCapsule<float>>& m) {
      const auto lane = [&](const auto& field) {
        float v[N];
        for (std::size_t i = 0; i < N; ++i) v[i] = field(m[first + i]);
        return P::load(v);
      };
      const auto point = [&](const auto& field) {
        return Vec3<P>{lane([&](const auto& c) { return field(c).x; }),
                       lane([&](const auto& c) { return field(c).y; }),
                       lane([&](const auto& c) { return field(c).z; })};
      };
      return MovingCapsule<P>{
          {point([](const auto& c) { return c.begin.p0; }),
           point([](const auto& c) { return c.begin.p1; }),
           lane([](const auto& c) { return c.begin.radius; })},
          {point([](const auto& c) { return c.end.p0; }), point([](const auto& c) { return c.end.p1; }),
           lane([](const auto& c) { return c.end.radius; })}};
    };
    const MovingCapsule<P> a = gather(pairs.agents), b = gather(pairs.bodies);
    const SweepResult<P> r = sweep(a, b, SweepRules<float>{});
    const CapsuleGap<P> g = capsule_gap(a.begin, b.begin);
    for (int i = 0; i < N; ++i) {
      const auto &u = pairs.agents[first + static_cast<std::size_t>(i)],
                 &v = pairs.bodies[first + static_cast<std::size_t>(i)];
      const SweepResult<float> s = sweep(u, v, SweepRules<float>{});
      const CapsuleGap<float> h = capsule_gap(u.begin, v.begin);
      const auto bit = [i](const Mask<N>& m) { return (lane_bits(m) >> i & 1u) != 0; };
      bool equal = bit(r.hit) == s.hit && bit(r.pushed) == s.pushed &&
                   bit(r.agent_closing) == s.agent_closing && same(r.time[i], s.time) &&
                   same(r.contact_time[i], s.contact_time) && same(r.gap[i], s.gap) &&
                   same(r.start_gap[i], s.start_gap) && same(g.gap[i], h.gap);
      for (int k = 0; k < 3; ++k) {
        equal = equal && same(r.normal[k][i], s.normal[k]) && same(r.point[k][i], s.point[k]) &&
                same(g.normal[k][i], h.normal[k]) && same(g.on_a[k][i], h.on_a[k]) &&
                same(g.on_b[k][i], h.on_b[k]);
      }
      differ += equal ? 0 : 1;
    }
  }
  return differ;
}

}  // namespace

TEST_CASE("capsules: packs of every width compute the bits of one pair") {
  for (const CapsulePairs& pairs : {random_pairs(1, 20000), hard_pairs()}) {
    CHECK(differing_packs<4>(pairs) == 0);
    CHECK(differing_packs<8>(pairs) == 0);
    CHECK(differing_packs<16>(pairs) == 0);
  }
}

TEST_CASE("capsules: batches on every backend compute the bits of one pair") {
  // Numbers of pairs around a range's and a pack's end.
  for (const std::size_t n : {0u, 1u, 15u, 17u, 1023u, 1025u, 20011u}) {
    const CapsulePairs pairs = random_pairs(n + 2, n);
    SerialBackend serial;
    check_batch<float>(serial, pairs, "serial float");
    check_batch<double>(serial, pairs, "serial double");
    ToyBackend toy;
    check_batch<float>(toy, pairs, "third-party float, memory of its own");
#if defined(_OPENMP)
    for (const int threads : {1, 3}) {
      OpenMPBackend openmp(threads);
      check_batch<float>(openmp, pairs,
                         std::string(lane_kernels().name) + ", threads: " + std::to_string(threads));
      check_batch<float>(openmp, hard_pairs(), "hard pairs");
    }
#endif
  }
}

#if defined(_OPENMP) && defined(__x86_64__) && defined(__GNUC__)
namespace {

/// Whether this processor says which registers are in use (XGETBV of 1).
bool says_what_is_in_use() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __builtin_cpu_supports("avx") && __get_cpuid_count(0xd, 1, &a, &b, &c, &d) != 0 &&
         (a & 4u) != 0;
}

/// Upper halves of vector registers that hold something: of the sixteen that code without AVX uses too.
unsigned upper_halves_in_use() {
  unsigned low = 0, high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
  return low & 0x44u;
}

}  // namespace

TEST_CASE(
    "lanes: leave nothing in the upper halves of registers, which would slow down all that follows") {
  if (!says_what_is_in_use()) {
    MESSAGE("SKIP: this processor does not say which registers are in use");
    return;
  }
  __asm__ volatile("vpcmpeqd %%xmm0, %%xmm0, %%xmm0\n\tvinsertf128 $1, %%xmm0, %%ymm0, %%ymm0" ::
                       : "xmm0");
  const unsigned dirty = upper_halves_in_use();
  __asm__ volatile("vzeroupper" ::: "memory");
  if (dirty == 0 || upper_halves_in_use() != 0) {
    MESSAGE("SKIP: this processor does not tell used registers from others");
    return;
  }
  SerialBackend serial;
  PairPlanes<float, SerialBackend> p(serial, random_pairs(10, 512));
  const LaneKernels& kernels = lane_kernels();
  CAPTURE(std::string(kernels.name));
  for (const auto& run : {+[](const LaneKernels&k, const PairPlanes<float, SerialBackend>&of) {
                            k.gap_range(of.gaps, 0, 512);
                          },
                          +[](const LaneKernels&k, const PairPlanes<float, SerialBackend>&of) {
                            k.sweep_range(of.sweeps, 0, 512);
                          }}) {
    run(kernels, p);
    const unsigned after = upper_halves_in_use();
    __asm__ volatile("vzeroupper" ::: "memory");
    CHECK(after == 0);
  }
}
#endif

#if defined(GSNAV_HAS_CUDA)
TEST_CASE("capsules, cuda: gaps and sweeps have the CPU's bits") {
  if (no_gpu("capsules on the GPU")) return;
  CudaBackend cuda;
  for (const std::size_t n : {0u, 1u, 127u, 129u, 200003u}) {
    check_batch<float>(cuda, random_pairs(n + 2, n), "cuda float");
    check_batch<double>(cuda, random_pairs(n + 3, n), "cuda double");
  }
  check_batch<float>(cuda, hard_pairs(), "cuda float, hard pairs");
  check_batch<double>(cuda, hard_pairs(), "cuda double, hard pairs");
}
#endif

TEST_CASE("capsules: arrays that do not fit are refused by name") {
  SerialBackend backend;
  PairPlanes<float, SerialBackend> p(backend, random_pairs(9, 10));
  auto gaps = p.gaps;
  gaps.b.p1[2].size = 9;
  CHECK(capsule_gaps(backend, gaps).message().find("CapsuleGapArgs.b has 9 values where 10") !=
        std::string::npos);
  gaps = p.gaps;
  gaps.normal[0] = {};
  CHECK(capsule_gaps(backend, gaps).message().find("normal has 10 values where 0") != std::string::npos);
  auto sweeps = p.sweeps;
  sweeps.bodies.end.radius.size = 11;
  CHECK(sweep_capsules(backend, sweeps).message().find("SweepArgs.bodies.end has 11") !=
        std::string::npos);
  sweeps = p.sweeps;
  sweeps.outcome.size = 3;
  CHECK(sweep_capsules(backend, sweeps).message().find("outcome") != std::string::npos);
}
