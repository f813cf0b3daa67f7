// SPDX-License-Identifier: Apache-2.0
// The two performance tables of the Habitat-GS paper by this simulator: a PointNav loop with 256 x 256 RGB and depth,
// frames a second, milliseconds and memory, by the number of Gaussians and by the number of people among 2M. Scenes and
// people are the project's own: the embedded flat, made as dense as the row says.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

#include "../tools/report/runner_system.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/sim/follower.hpp"
#include "gsnav/sim/people.hpp"
#include "gsnav/sim/scene_library.hpp"
#include "gsnav/sim/simulator.hpp"

using namespace gsnav;
using Clock = std::chrono::steady_clock;

namespace {

constexpr double kGaussiansAtOne = 390000;  // of the flat with density 1, about
constexpr int kSide = 256;

struct Options {
  int steps = 300, threads = 0;
  double most = 7;  // millions of Gaussians
};

struct Row {
  std::size_t gaussians = 0, people = 0;
  double ms = 0, rendering = 0, scene_mb = 0, peak_mb = 0;
};

double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// Plays episodes by the follower for so many actions; the first ten find the scratch that is taken.
Row play(const Options& o, double millions, std::size_t people) {
  gsnav_report::reset_peak_memory();
  const double before = static_cast<double>(gsnav_report::peak_memory());
  const TaskConfig task = TaskConfig::avatar_pointnav();
  auto scene = std::make_shared<const SimulatorScene>(
      default_simulator_scene(people, 1, millions * 1e6 / kGaussiansAtOne, task).value());
  Row row;
  row.gaussians = scene->assets[0].cloud->size();
  row.people = people;
  row.scene_mb = static_cast<double>(scene_bytes(*scene)) * 1e-6;
  auto episodes = generate_episodes(*scene->navmesh, 20, 1).value();
  draw_start_times(episodes, *scene, task, 1).throw_if_error();
  OpenMPBackend backend(o.threads);
  SimulatorConfig config;
  config.task = task;
  config.sensors = rgbd_sensors(kSide, kSide);
  auto sim = Simulator<OpenMPBackend>::create(backend, scene, config).value();
  gsnav_report::reset_peak_memory();
  const GeodesicFollower follower;
  std::size_t episode = 0;
  double total = 0, beside = 0;
  for (int i = -10; i < o.steps; ++i) {
    if (i == -10 || sim.done()) sim.reset(episodes[episode++ % episodes.size()]).value();
    const Action action = follower.next(sim.world());
    const auto begin = Clock::now();
    sim.set_rendering(false);
    sim.step(action).value();
    const double world = seconds_since(begin);
    sim.set_rendering(true);
    sim.observe().value();
    if (i < 0) continue;
    total += seconds_since(begin);
    beside += world;
  }
  row.ms = 1e3 * total / o.steps;
  row.rendering = 1.0 - beside / total;
  row.peak_mb = (static_cast<double>(gsnav_report::peak_memory()) - before) * 1e-6;
  return row;
}

void head(const char* what) {
  std::printf("\n%s\n%12s %8s %12s %10s %11s %10s %10s\n", what, "Gaussians", "people", "frames/s", "ms", "rendering",
              "scene, MB", "peak, MB");
}

void print(const Row& r) {
  std::printf("%12zu %8zu %12.1f %10.2f %10.1f%% %10.0f %10.0f\n", r.gaussians, r.people, 1e3 / r.ms, r.ms, 100 * r.rendering,
              r.scene_mb, r.peak_mb);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  Options o;
  CLI::App app{"A PointNav loop with 256 x 256 RGB and depth: speed and memory by Gaussians and by people."};
  app.add_option("--steps", o.steps, "actions a row")->capture_default_str()->check(CLI::Range(1, 1000000));
  app.add_option("--threads", o.threads, "threads, 0: all")->capture_default_str()->check(CLI::Range(0, 1024));
  app.add_option("--most", o.most, "no row with more millions of Gaussians")->capture_default_str()->check(CLI::Range(0.02, 7.0));
  CLI11_PARSE(app, argc, argv);
  std::printf("OpenMP backend, %zu threads, %s; %d actions a row\n", OpenMPBackend(o.threads).concurrency(),
              gsnav_report::machine_name().c_str(), o.steps);
  head("by Gaussians");
  for (const double millions : {0.3, 0.5, 1.0, 3.0, 5.0, 7.0}) {
    if (millions <= o.most) print(play(o, millions, 0));
  }
  head("by people among 2M (fewer where --most says so)");
  for (const std::size_t people : {0, 1, 2, 5, 10}) print(play(o, std::min(2.0, o.most), people));
#if defined(GSNAV_HAS_CUDA)
  std::printf("\nCUDA: the simulator's loop renders by host backends; bench_batch has the GPU's frames.\n");
#endif
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "bench_paper_table: %s\n", e.what());
  return 1;
}
