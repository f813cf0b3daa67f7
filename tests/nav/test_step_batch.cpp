// SPDX-License-Identifier: Apache-2.0
// Property 5: batches of steps have the bits of one step after the other, on any backend, with any
// number of threads.
#include <doctest/doctest.h>

#include <cstring>
#include <limits>
#include <vector>

#include "gsnav/detail/nav/step_batch.hpp"
#include "ops/backends.hpp"
#include "step_oracle.hpp"
#include "step_scene.hpp"
#include "support/random_cases.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#include "ops/no_gpu.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }
bool same(const Vec3d& a, const Vec3d& b) { return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z); }
bool same(const StepResult& a, const StepResult& b) {
  bool equal = same(a.position, b.position) && a.poly == b.poly && same(a.fraction, b.fraction) &&
               a.blocked_by == b.blocked_by && a.hit_wall == b.hit_wall &&
               same(a.wall_normal, b.wall_normal) && same(a.toi, b.toi) && a.avatar == b.avatar &&
               a.bone == b.bone && same(a.contact_point, b.contact_point) && same(a.normal, b.normal) &&
               a.agent_caused == b.agent_caused && a.started_overlapping == b.started_overlapping &&
               a.pushed_into == b.pushed_into && same(a.pushed_toi, b.pushed_toi) &&
               a.pushed_avatar == b.pushed_avatar && a.pushed_bone == b.pushed_bone &&
               a.path.size() == b.path.size();
  for (std::size_t i = 0; equal && i < a.path.size(); ++i) {
    equal = same(a.path[i].position, b.path[i].position) && a.path[i].poly == b.path[i].poly &&
            same(a.path[i].fraction, b.path[i].fraction);
  }
  return equal;
}

/// Agents on a mesh of boxes, some of them nowhere or overlapping, among walkers that some of them meet.
struct Scene {
  NavMesh mesh;
  std::vector<AgentState> agents;
  std::vector<Vec3d> desired;
  CapsuleSet bodies;
  StepOptions options;

  Scene(std::uint64_t seed, std::size_t n) : mesh(make(seed)) {
    Rng rng(seed);
    const double inf = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < n; ++i) {
      const NavPoint p = mesh.random_point(rng, 0);
      AgentState a{p.position, rng.uniform(0, 0.3), rng.uniform(0.2, 1.8),
                   i % 3 == 0 ? kNoPoly : p.poly};
      if (i % 97 == 5) a.position.x = i % 2 == 0 ? 1e4 : inf;
      agents.push_back(a);
      desired.push_back(heading(rng, i % 11 == 0 ? rng.uniform(0, 20) : rng.uniform(0, 0.5)));
      if (i % 13 == 0) desired.back() = {};
    }
    std::vector<DynamicCapsule> list;
    for (std::uint32_t a = 0; a < 40; ++a) {
      const Vec3d at = mesh.random_point(rng, 0).position, by = heading(rng, rng.uniform(0, 2));
      for (std::uint32_t bone = 0; bone < 5; ++bone) {
        const Vec3d p{rng.uniform(-0.3, 0.3), rng.uniform(0.1, 1.6), rng.uniform(-0.3, 0.3)};
        const Vec3d q{rng.uniform(-0.3, 0.3), rng.uniform(0.1, 1.6), rng.uniform(-0.3, 0.3)};
        list.push_back({{{at + p, at + q, 0.1}, {at + by + q, at + by + p, 0.12}}, a, bone});
      }
    }
    bodies = CapsuleSet::create(std::move(list)).value();
    options.slide = seed % 2 == 0;
  }
  static NavMesh make(std::uint64_t seed) {
    const Soup soup = random_boxes(seed, 15, 12);
    NavMeshSettings s;
    s.cell_size = 0.1;
    return NavMesh::build(s, soup.vertices, soup.triangles).value();
  }
  std::vector<StepResult> one_by_one() const {
    std::vector<StepResult> out;
    for (std::size_t i = 0; i < agents.size(); ++i)
      out.push_back(step(mesh, agents[i], desired[i], bodies, options));
    return out;
  }
};

/// How many results of `run(batch)` differ from `expected`.
template <class F>
std::size_t differing(const Scene& s, const std::vector<StepResult>& expected, const F& run) {
  std::vector<StepResult> results(s.agents.size());
  REQUIRE(run(StepBatch{s.agents, s.desired, results}).ok());
  std::size_t n = 0;
  for (std::size_t i = 0; i < results.size(); ++i) n += same(results[i], expected[i]) ? 0 : 1;
  return n;
}

}  // namespace

TEST_CASE(
    "property 5: batches of steps have the bits of single steps on any number of threads, device or "
    "not") {
  std::size_t steps = 0, met = 0, invalid = 0;
  const auto n = static_cast<std::size_t>(cases(25000));
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const Scene s(seed, n);
    const std::vector<StepResult> expected = s.one_by_one();
    for (const StepResult& r : expected) {
      ++steps;
      met += r.blocked_by == BlockedBy::capsule || r.pushed_into ? 1 : 0;
      invalid += r.blocked_by == BlockedBy::invalid ? 1 : 0;
    }
    SerialBackend serial;
    ToyBackend toy;  // runs backwards, in memory of its own
    CHECK(differing(s, expected, [&](const StepBatch& b) {
            return step_all(serial, s.mesh, b, s.bodies, s.options);
          }) == 0);
    CHECK(differing(s, expected, [&](const StepBatch& b) {
            return step_all(serial, toy, s.mesh, b, s.bodies, s.options);
          }) == 0);
#if defined(_OPENMP)
    for (const int threads : {1, 2, 5}) {
      OpenMPBackend openmp(threads);
      CHECK(differing(s, expected, [&](const StepBatch& b) {
              return step_all(openmp, s.mesh, b, s.bodies, s.options);
            }) == 0);
      CHECK(differing(s, expected, [&](const StepBatch& b) {
              return step_all(openmp, openmp, s.mesh, b, s.bodies, s.options);
            }) == 0);
    }
#endif
  }
  MESSAGE(steps << " steps, " << met << " met somebody, " << invalid << " invalid");
  CHECK(met > steps / 50);
  CHECK(invalid > 0);
}

#if defined(GSNAV_HAS_CUDA)
TEST_CASE("property 5, cuda: steps swept on the GPU have the CPU's bits") {
  if (no_gpu("steps on the GPU")) return;
  CudaBackend cuda;
  SerialBackend serial;
  for (const std::uint64_t seed : {1u, 2u}) {
    const Scene s(seed, static_cast<std::size_t>(cases(50000)));
    CHECK(differing(s, s.one_by_one(), [&](const StepBatch& b) {
            return step_all(serial, cuda, s.mesh, b, s.bodies, s.options);
          }) == 0);
  }
}
#endif

TEST_CASE("batches of steps: spans of other sizes are refused by name") {
  const Scene s(5, 10);
  SerialBackend serial;
  std::vector<StepResult> results(9);
  const Status few = step_all(serial, s.mesh, {s.agents, s.desired, results}, s.bodies);
  CHECK(few.code() == Errc::invalid_argument);
  CHECK(few.message().find("StepBatch.results has 9 values for 10 agents") != std::string::npos);
  results.resize(10);
  CHECK(step_all(serial, s.mesh, {s.agents, std::span(s.desired).first(3), results}, s.bodies)
            .message()
            .find("desired") != std::string::npos);
  CHECK(step_all(serial, s.mesh, {{}, {}, {}}, s.bodies).ok());
}
