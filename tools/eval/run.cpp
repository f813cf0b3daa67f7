// SPDX-License-Identifier: Apache-2.0
#include "run.hpp"

#include <cstdio>
#include <functional>
#include <optional>
#include <utility>

#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"
#include "gsnav/sim.hpp"
#include "gsnav/sim/follower.hpp"

namespace gsnav_eval {

using gsnav::Result;
using gsnav::Status;

Result<Stage> prepare(const Options& o) {
  gsnav::OpenOptions how = gsnav_tools::open_options(o);
  const std::vector<gsnav::SensorSpec> sensors =
      gsnav::rgbd_sensors(o.height, o.width, o.hfov, {0, o.eye_height, 0});
  how.eye = gsnav::sensor_camera(sensors[0], {}, {});
  gsnav_tools::print_device(o.device, stderr);
  auto opened = gsnav_tools::open_scene(o, how, stderr);
  if (!opened) return opened.status();
  Stage stage;
  stage.config.task = o.preset == "v2"       ? gsnav::TaskConfig::pointnav_v2()
                      : o.preset == "avatar" ? gsnav::TaskConfig::avatar_pointnav()
                                             : gsnav::TaskConfig{};
  stage.config.task.max_steps = o.max_steps;
  stage.config.render.quality = gsnav_tools::quality_of(o);
  const gsnav::DetailChoice detail = gsnav_tools::detail_of(o, *opened);
  stage.config.lod = detail.lod;
  stage.config.visible_sets = detail.visible_sets;
  stage.config.sensors = sensors;
  if (o.episode_file.empty()) {
    auto made =
        gsnav::generate_episodes(*opened->scene->navmesh, static_cast<std::size_t>(o.episodes), o.seed);
    if (!made) return made.status();
    if (Status s = gsnav::draw_start_times(*made, *opened->scene, stage.config.task, o.seed); !s)
      return s;
    stage.episodes = std::move(*made);
  } else {
    auto file = gsnav::io::load_episodes(o.episode_file);
    if (!file) return file.status();
    for (const std::string& w : file->warnings)
      std::fprintf(stderr, "%s\n", gsnav::printable(w).c_str());
    stage.episodes = std::move(file->episodes);
  }
  stage.scene = opened->scene;
  return stage;
}

Result<gsnav::World> make_world(const Stage& stage) {
  return gsnav::World::create(
      stage.scene->navmesh, stage.config.task,
      [scene = stage.scene](double t0, double t1, auto& out) { append_bodies(*scene, t0, t1, out); });
}

Result<Record> play(gsnav::World& world, const Options& o, const gsnav::PointNavEpisode& episode,
                    std::size_t number, const std::function<Status(const gsnav::World&)>& look) {
  if (Status s = world.reset(episode); !s) return s;
  if (look) {
    if (Status s = look(world); !s) return s;
  }
  Record r;
  r.episode = number;
  r.id = episode.id;
  const gsnav::GeodesicFollower follower;
  gsnav::RandomPolicy random(o.seed + 0x9e3779b97f4a7c15ull * (number + 1));
  std::optional<gsnav::GreedyGeodesicFollower> greedy;
  if (o.policy == "greedy") {
    gsnav::GreedyFollowerOptions how;
    how.goal_radius = 0.95 * world.config().success_distance;
    auto made =
        gsnav::GreedyGeodesicFollower::make(world.navmesh(), episode.goal_position, world.config(), how);
    if (!made) return made.status();
    greedy.emplace(std::move(*made));
  }
  while (!world.done()) {
    gsnav::Action action = gsnav::Action::stop;
    if (greedy) {
      const auto next = greedy->next(world.agent());
      if (!next) return next.status();
      action = *next;
    } else {
      action = o.policy == "random" ? random.next(world) : follower.next(world);
    }
    const auto step = world.step(action);
    if (!step) return step.status();
    if (look) {
      if (Status s = look(world); !s) return s;
    }
    r.reward += step->reward;
    r.actions.push_back(action);
  }
  r.metrics = world.metrics();
  return r;
}

}  // namespace gsnav_eval
