// SPDX-License-Identifier: Apache-2.0
// What the simulator costs beside rendering: one action in many environments, and one in one.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "gsnav/avatar/humanoid.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/sim/batch.hpp"
#include "gsnav/sim/default_scene.hpp"

namespace {

using namespace gsnav;

std::shared_ptr<const SimulatorScene> flat(int people) {
  const DefaultScene flat = make_default_scene(0.05).value();
  SimulatorScene s;
  s.assets.push_back({std::make_shared<const GaussianCloud>(flat.cloud), {}});
  s.navmesh = std::make_shared<const NavMesh>(NavMesh::build({}, flat.vertices, flat.triangles).value());
  HumanoidOptions look;
  look.gaussians = 2000;
  const auto body = std::make_shared<const AvatarAsset>(make_humanoid(look));
  Rng rng(3);
  for (int i = 0; i < people; ++i) {
    std::vector<Vec3d> way;
    for (int k = 0; k < 3; ++k) way.push_back(s.navmesh->random_point(rng, std::size_t{0}).position);
    s.avatars.push_back(make_walker(body, way).value());
  }
  return std::make_shared<const SimulatorScene>(std::move(s));
}

BatchConfig without_pictures() {
  BatchConfig c;
  c.rendering = false;
  return c;
}

/// When episodes begin.
enum Times : std::int64_t { kAnywhen, kAtOnce, kAtMultiples };

EpisodeSource generated(const std::shared_ptr<const SimulatorScene>& scene, std::int64_t times) {
  return [scene, times](std::size_t e, std::size_t count) -> Result<BatchEpisode> {
    Rng rng(100000 * e + count);
    auto made = generate_episode(*scene->navmesh, rng);
    if (!made) return made.status();
    if (times != kAtOnce) made->start_time = rng.uniform(0.0, 600.0);
    if (times == kAtMultiples) made->start_time = 0.25 * std::floor(4.0 * made->start_time);
    return BatchEpisode{0, std::move(*made)};
  };
}

/// Arguments: environments, people, threads, when episodes begin. A minute has gone by when it is measured.
void step_batch(benchmark::State& state) {
  const auto scene = flat(static_cast<int>(state.range(1)));
  const auto n = static_cast<std::size_t>(state.range(0));
  OpenMPBackend backend(static_cast<int>(state.range(2)));
  auto sim = make_batch_simulator(backend, {scene}, without_pictures(), n, generated(scene, state.range(3))).value();
  sim.reset().value();
  Rng rng(9);
  std::vector<Action> actions(n);
  const auto step = [&] {
    for (Action& a : actions) a = rng.below(3) == 0 ? Action::turn_left : Action::move_forward;
    benchmark::DoNotOptimize(sim.step(actions).value());
  };
  for (int i = 0; i < 240; ++i) step();
  for (auto _ : state) step();
  state.counters["us/environment"] = benchmark::Counter(static_cast<double>(n) * 1e-6,
                                                        benchmark::Counter::kIsIterationInvariantRate |
                                                            benchmark::Counter::kInvert);
}
BENCHMARK(step_batch)
    ->ArgNames({"environments", "people", "threads", "times"})
    ->Args({256, 0, 1, kAtOnce})
    ->Args({256, 0, 2, kAtOnce})
    ->Args({256, 5, 2, kAtOnce})
    ->Args({256, 5, 2, kAtMultiples})
    ->Args({256, 5, 2, kAnywhen})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// One simulator, or its World alone.
void step_one(benchmark::State& state) {
  const auto scene = flat(static_cast<int>(state.range(0)));
  OpenMPBackend backend(1);
  auto sim = Simulator<OpenMPBackend>::create(backend, scene, without_pictures()).value();
  World world = sim.world();
  const EpisodeSource source = generated(scene, kAtOnce);
  std::size_t count = 0;
  const auto begin = [&] {
    const PointNavEpisode e = source(0, count++).value().episode;
    sim.reset(e).value();
    world.reset(e).throw_if_error();
  };
  begin();
  Rng rng(9);
  for (auto _ : state) {
    if (sim.done() || world.done()) begin();
    const Action a = rng.below(3) == 0 ? Action::turn_left : Action::move_forward;
    if (state.range(1) != 0) {
      benchmark::DoNotOptimize(sim.step(a).value());
    } else {
      benchmark::DoNotOptimize(world.step(a).value());
    }
  }
}
BENCHMARK(step_one)->ArgNames({"people", "facade"})->ArgsProduct({{0, 5}, {0, 1}})->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
