// SPDX-License-Identifier: Apache-2.0
// Cost of the simulator without rendering: one action in many environments, one action in one
// environment, and the posing of ten people. On a GPU also the cost of a frame (bench_sim_cuda.cpp).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/avatar/weight_gradients.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#include "gsnav/sim/basic_batch.hpp"

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

/// Times at which episodes begin.
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

/// Arguments: environments, people, threads, times at which episodes begin. The measurement starts one
/// minute into the run.
void step_batch(benchmark::State& state) {
  const auto scene = flat(static_cast<int>(state.range(1)));
  const auto n = static_cast<std::size_t>(state.range(0));
  OpenMPBackend backend(static_cast<int>(state.range(2)));
  auto sim =
      make_batch_simulator(backend, {scene}, without_pictures(), n, generated(scene, state.range(3)))
          .value();
  sim.reset().value();
  Rng rng(9);
  std::vector<Action> actions(n);
  const auto step = [&] {
    for (Action& a : actions) a = rng.below(3) == 0 ? Action::turn_left : Action::move_forward;
    benchmark::DoNotOptimize(sim.step(actions).value());
  };
  for (int i = 0; i < 240; ++i) step();
  for (auto _ : state) step();
  state.counters["us/environment"] =
      benchmark::Counter(static_cast<double>(n) * 1e-6,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(step_batch)
    ->ArgNames({"environments", "people", "threads", "times"})
    ->Args({256, 0, 1, kAtOnce})
    ->Args({256, 0, 2, kAtOnce})
    ->Args({256, 5, 2, kAtOnce})
    ->Args({256, 5, 2, kAtMultiples})
    ->Args({256, 5, 2, kAnywhen})
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()  // of all threads: the cost is right also on a busy machine
    ->UseRealTime();

/// One simulator, or its World alone.
void step_one(benchmark::State& state) {
  const auto scene = flat(static_cast<int>(state.range(0)));
  OpenMPBackend backend(1);
  auto sim = BasicSimulator<OpenMPBackend>::create(backend, scene, without_pictures()).value();
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
BENCHMARK(step_one)
    ->ArgNames({"people", "facade"})
    ->ArgsProduct({{0, 5}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

/// Ten people of one body walk: forward kinematics and skinning of all. Arguments: Gaussians of the
/// body, threads, Skinning. Counters: the error against float64, and the memory that they share and that
/// each of them has.
void pose_crowd(benchmark::State& state) {
  constexpr std::size_t kPeople = 10;
  HumanoidOptions look;
  look.gaussians = static_cast<int>(state.range(0));
  AvatarAsset made = make_humanoid(look);
  if (state.range(2) == static_cast<int>(Skinning::linear_stretched))
    bake_weight_gradients(made).throw_if_error();
  made.skinning = static_cast<Skinning>(state.range(2));
  const auto body = std::make_shared<const AvatarAsset>(std::move(made));
  std::vector<AvatarActor> people;
  OpenMPBackend backend(static_cast<int>(state.range(1)));
  SkinnedCrowd<OpenMPBackend> crowd(backend);
  for (std::size_t i = 0; i < kPeople; ++i) {
    const double x = static_cast<double>(i);
    people.push_back(make_walker(body, {{x, 0, 0}, {x, 0, 5.0 + 0.3 * x}}).value());
    crowd.add(body);
  }
  double t = 0.0;
  for (auto _ : state) {
    crowd.pose(people, t += 0.05).throw_if_error();
    backend.synchronize().throw_if_error();
  }
  double worst = 0.0;
  std::vector<Affine3<double>> joints;
  for (std::size_t i = 0; i < kPeople; ++i) {
    people[i].joint_globals(t, joints);
    const std::vector<Vec3d> centers = skinned_centers(*body, joints);
    const ShapeRows v = crowd.set(i).gaussians.shape;
    for (std::size_t k = 0; k < centers.size(); ++k) {
      worst = std::max(worst, norm(vec_cast<double>(Vec3f{v.means[0][k], v.means[1][k], v.means[2][k]}) -
                                   centers[k]));
    }
  }
  const double n = static_cast<double>(body->size());
  const double row = static_cast<double>(body->influences);
  const bool stretched = body->skinning == Skinning::linear_stretched;
  state.counters["mean_max_m"] = worst;
  // Shared: means, quaternions, scales, opacities, colours, joints and weights. Each person has its own
  // means and quaternions, or also axes.
  state.counters["shared_MB"] = n * 1e-6 * (4 * 14 + 4 * row + (stretched ? 12 * (row - 1) : 0));
  state.counters["each_MB"] = n * 1e-6 * 4 * (stretched ? 16 : 7);
  state.counters["Gaussians/s"] =
      benchmark::Counter(n * kPeople, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(pose_crowd)
    ->ArgNames({"gaussians", "threads", "skinning"})
    ->ArgsProduct({{100000}, {1, 2}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
