// SPDX-License-Identifier: Apache-2.0
// nav_loop: an agent with cameras follows its goal among people who walk through a scene of Gaussians.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include "../../tools/common/check_values.hpp"
#include "../../tools/common/parse_options.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/device/simulator.hpp"
#include "gsnav/sim/follower.hpp"
#include "recorder.hpp"
#include "setup.hpp"

namespace nav_loop {
namespace {

using gsnav::Status;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

Status run(const Options& options) {
  Recorder recorder(options);
  if (Status s = recorder.open(); !s) return s;
  auto prepared = prepare(options);
  if (!prepared) return prepared.status();
  Setup setup = std::move(*prepared);

  gsnav::SimulatorConfig config;
  config.task.max_steps = options.max_steps;
  config.sensors = sensors_of(options);
  config.render.quality = gsnav_tools::quality_of(options);
  config.lod = setup.detail.lod;
  config.visible_sets = setup.detail.visible_sets;
  const auto episodes = make_episodes(options, *setup.scene, config.task);
  if (!episodes) return episodes.status();
  auto made = gsnav::Simulator::create(options.device, setup.scene, config);
  if (!made) return made.status();
  auto& sim = *made;

  Progress progress(options.episodes);
  const gsnav::GeodesicFollower policy;
  std::vector<EpisodeRecord> records;
  Timings& t = setup.timings;

  // Step without rendering, then render, so that each is timed alone.
  const auto observe = [&]() -> gsnav::Result<gsnav::Observations> {
    const auto from = Clock::now();
    auto obs = sim.observe();
    t.render += seconds_since(from);
    ++t.renders;
    return obs;
  };
  for (int i = 0; i < options.episodes; ++i) {
    EpisodeRecord record{(*episodes)[static_cast<std::size_t>(i)], {}, false};
    sim.set_rendering(false);
    if (const auto r = sim.reset(record.episode); !r) return r.status();
    recorder.begin(sim.world(), i);
    while (true) {
      sim.set_rendering(true);
      const auto obs = observe();
      sim.set_rendering(false);
      if (!obs) return obs.status();
      if (Status s = recorder.add(sim.world(), *obs); !s) return s;
      if (sim.done()) break;

      auto from = Clock::now();
      const gsnav::Action action = policy.next(sim.world());
      t.policy += seconds_since(from);
      from = Clock::now();
      const auto stepped = sim.step(action);
      t.physics += seconds_since(from);
      if (!stepped) return stepped.status();
      record.pushed = record.pushed || stepped->pushed_into;
      if (action == gsnav::Action::stop) break;
      ++t.steps;
      progress.step(i, t.steps, sim.world().point_goal().distance);
    }
    record.metrics = sim.metrics();
    progress.episode(i, record);
    records.push_back(record);
    recorder.end(sim.world(), sim.scene().avatars);
  }
  if (Status s = recorder.finish(*setup.scene); !s) return s;
  print_table(options, setup.facts, records, t);
  if (Status s = write_json(options.out + "/metrics.json", options, setup.facts, records); !s) return s;
  if (Status s = write_timings(options.out + "/timings.json", options.device, t); !s) return s;
  std::printf("Pictures, metrics.json and timings.json are in %s\n",
              gsnav::printable(options.out).c_str());
  return {};
}

}  // namespace
}  // namespace nav_loop

int main(int argc, char** argv) try {
  nav_loop::Options o;
  CLI::App app{
      "Runs PointNav episodes among people who walk through a scene of 3D Gaussians.\nWrites images, a "
      "strip and a map of one episode, metrics.json and timings.json.\nWithout options: ten episodes in "
      "the embedded flat, with three people."};
  app.add_option("--episodes", o.episodes, "number of episodes")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--out", o.out, "folder for everything that is written; made if it does not exist")
      ->capture_default_str();
  gsnav_tools::add_view_options(app, o);
  app.add_option("--frames-every", o.frame_every, "write every Nth RGB and depth frame; 0 writes none")
      ->capture_default_str()
      ->check(CLI::Range(0, 100000));
  app.add_option("--show", o.shown_episode,
                 "episode of strip.png and map.png, from 0; -1 takes the one with the closest encounter")
      ->capture_default_str()
      ->check(CLI::Range(-1, 100000));
  app.add_option("--max-steps", o.max_steps, "number of actions after which an episode ends")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  gsnav_tools::add_scene_options(app, o);
  gsnav_tools::refuse_value(app, "--navmesh", "none", "agents need one; use auto");
  gsnav_tools::refuse_value(app, "--storage", "packed", "maps read the floats; use full or compact");
  const auto check = [&o] {
    if (o.shown_episode < o.episodes) return;
    throw CLI::ValidationError("--show " + std::to_string(o.shown_episode) + ": of " +
                               std::to_string(o.episodes) + " episodes the last is " +
                               std::to_string(o.episodes - 1));
  };
  if (const auto status = gsnav_tools::parse_options(app, argc, argv, check)) return *status;
  const gsnav::Status s = nav_loop::run(o);
  if (!s) std::fprintf(stderr, "nav_loop: %s\n", s.message().c_str());
  return s ? 0 : 1;
} catch (const std::exception& e) {
  std::fprintf(stderr, "nav_loop: %s\n", e.what());
  return 1;
}
