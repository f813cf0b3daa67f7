// SPDX-License-Identifier: Apache-2.0
// Steps and plans of agents among walkers.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "bench_nav_scenes.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/nav/local_planner.hpp"
#include "gsnav/detail/nav/step_batch.hpp"
#include "gsnav/detail/nav/time_planner.hpp"

using namespace gsnav;
using namespace gsnav_bench;

namespace {

/// `avatars` walkers of 20 capsules each, spread over the mesh.
CapsuleSet walkers(const Scene& scene, std::size_t avatars) {
  Rng rng(3);
  std::vector<DynamicCapsule> list;
  for (std::size_t a = 0; a < avatars; ++a) {
    const Vec3d at = scene.main_points[4095 - a].position,
                v{rng.uniform(-0.05, 0.05), 0, rng.uniform(-0.05, 0.05)};
    for (std::uint32_t bone = 0; bone < 20; ++bone) {
      const Vec3d p0{rng.uniform(-0.3, 0.3), rng.uniform(0.1, 1.7), rng.uniform(-0.3, 0.3)};
      const Vec3d p1{rng.uniform(-0.3, 0.3), rng.uniform(0.1, 1.7), rng.uniform(-0.3, 0.3)};
      const Capsule<double> c{at + p0, at + p1, 0.06};
      list.push_back({{c, {c.p0 + v, c.p1 + v, 0.06}}, static_cast<std::uint32_t>(a), bone});
    }
  }
  return CapsuleSet::create(std::move(list)).value();
}
AgentState agent_at(const Scene& scene, std::size_t i) {
  const NavPoint& p = scene.main_points[i & 1023u];
  return {p.position, 0.1, 1.5, p.poly};
}
Vec3d quarter_metre(std::size_t i) {
  const double a = static_cast<double>(i & 1023u);
  return {0.25 * std::cos(a), 0, 0.25 * std::sin(a)};
}

/// Steps of 0.25 m for agents that keep their polygons from step to step.
void steps(benchmark::State& state, const Scene* (*make)()) {
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  const CapsuleSet bodies = walkers(*scene, static_cast<std::size_t>(state.range(0)));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(step(*scene->mesh, agent_at(*scene, i), quarter_metre(i), bodies));
    ++i;
  }
}

/// A tick of 1000 agents on one thread.
void thousand_agents(benchmark::State& state, const Scene* (*make)()) {
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  const CapsuleSet bodies = walkers(*scene, static_cast<std::size_t>(state.range(0)));
  std::vector<AgentState> agents;
  std::vector<Vec3d> desired;
  for (std::size_t i = 0; i < 1000; ++i) {
    agents.push_back(agent_at(*scene, i));
    desired.push_back(quarter_metre(i));
  }
  std::vector<StepResult> results(agents.size());
  SerialBackend serial;
  for (auto _ : state) {
    benchmark::DoNotOptimize(step_all(serial, *scene->mesh, {agents, desired, results}, bodies).ok());
  }
}

/// Velocities of agents for the next tick.
void local_plan(benchmark::State& state, const Scene* (*make)()) {
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  const CapsuleSet bodies = walkers(*scene, static_cast<std::size_t>(state.range(0)));
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        plan_velocity(*scene->mesh, agent_at(*scene, i), quarter_metre(i) * 4.0, bodies));
    ++i;
  }
}

/// Plans of 10 s in ticks of 0.25 s, among walkers of 20 capsules that go back and forth on the mesh.
void plan_in_time_among(benchmark::State& state, const Scene* (*make)()) {
  const auto avatars = static_cast<std::size_t>(state.range(0));
  const Scene* scene = make();
  if (scene == nullptr) return state.SkipWithError("the mesh is not in GSNAV_DATA_DIR");
  constexpr int kTicks = 40;
  constexpr double kTick = 0.25;
  std::vector<CapsuleSet> ticks;
  for (int k = 0; k < kTicks; ++k) {
    std::vector<DynamicCapsule> list;
    for (std::size_t a = 0; a < avatars; ++a) {
      const Vec3d from = scene->main_points[4095 - 2 * a].position;
      const Vec3d way = scene->main_points[4094 - 2 * a].position - from;
      const auto at = [&](double t) {
        const double u = 0.5 - 0.5 * std::cos(t / max(norm(way), 1.0) + static_cast<double>(a));
        return from + way * u;
      };
      Rng rng(a);
      for (std::uint32_t bone = 0; bone < 20; ++bone) {
        const Vec3d p{rng.uniform(-0.2, 0.2), rng.uniform(0.1, 1.6), rng.uniform(-0.2, 0.2)};
        const Vec3d q{rng.uniform(-0.2, 0.2), rng.uniform(0.1, 1.6), rng.uniform(-0.2, 0.2)};
        const Vec3d a0 = at(k * kTick), a1 = at((k + 1) * kTick);
        list.push_back(
            {{{a0 + p, a0 + q, 0.06}, {a1 + p, a1 + q, 0.06}}, static_cast<std::uint32_t>(a), bone});
      }
    }
    ticks.push_back(CapsuleSet::create(std::move(list), k * kTick, (k + 1) * kTick).value());
  }
  std::size_t i = 0, states = 0, reached = 0, slowest = 0;
  double longest = 0;
  for (auto _ : state) {
    const auto begin = std::chrono::steady_clock::now();
    const NavPoint& p = scene->main_points[i & 1023u];
    const Vec3d& goal = scene->main_points[(i + 1) & 1023u].position;
    const TimedPlan plan = plan_in_time(*scene->mesh, {p.position, 0.1, 1.5, p.poly}, goal, ticks);
    states += plan.states;
    reached += plan.status == TimedPlanStatus::reached ? 1 : 0;
    slowest = max(slowest, plan.states);
    longest =
        max(longest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    ++i;
  }
  state.counters["states"] = static_cast<double>(states) / static_cast<double>(i);
  state.counters["reached"] = static_cast<double>(reached) / static_cast<double>(i);
  state.counters["most_states"] = static_cast<double>(slowest);
  state.counters["longest_ms"] = 1e3 * longest;
}

BENCHMARK_CAPTURE(steps, flat, flat)->Arg(0)->Arg(3)->Arg(100);
BENCHMARK_CAPTURE(thousand_agents, flat, flat)->Arg(3)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(local_plan, flat, flat)->Arg(3)->Arg(10)->Arg(30)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(plan_in_time_among, flat, flat)
    ->Arg(0)
    ->Arg(3)
    ->Arg(10)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
