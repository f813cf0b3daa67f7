// SPDX-License-Identifier: Apache-2.0
#include "recorder.hpp"

#include <algorithm>
#include <cstdio>

#include "../../tools/common/check_values.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io/image_file.hpp"

namespace nav_loop {
namespace {

using gsnav_tools::Canvas;
using gsnav_tools::MapContent;
using gsnav_tools::Shot;

constexpr std::size_t kMostShots = 64;  // frames kept in memory for the strip

}  // namespace

gsnav::Status Recorder::open() {
  const std::string frames = options_.out + "/frames";
  gsnav::Status s = gsnav::make_output_folder(options_.frame_every > 0 ? frames : options_.out);
  if (s)
    s = gsnav_tools::check_files_in(options_.out,
                                    {"strip.png", "map.png", "metrics.json", "timings.json"});
  if (s) s = gsnav_tools::check_files_in(frames, {"_rgb.png", "_depth.png"});
  return s ? s : gsnav::Status(s.code(), "--out " + s.message());
}

void Recorder::begin(const gsnav::World& world, int episode) {
  episode_ = episode;
  step_ = 0;
  stride_ = 1;
  current_ = {};
  if (!wanted()) return;
  MapContent& map = current_.map;
  map.start = world.agent().position;
  map.goal = world.episode().goal_position;
  map.agent_radius = world.config().agent_radius;
  const auto path = world.navmesh().find_path(map.start, map.goal);
  if (path) map.shortest = path->points;
}

gsnav::Status Recorder::add(const gsnav::World& world, const gsnav::Observations& obs) {
  const std::size_t step = step_++;
  const bool save =
      options_.frame_every > 0 && step % static_cast<std::size_t>(options_.frame_every) == 0;
  const bool keep = wanted() && step % stride_ == 0;
  if (wanted()) {
    current_.map.agent.push_back(world.agent().position);
    if (step % 8 == 0) {
      const auto now = world.bodies(world.time(), world.time());
      if (now) current_.map.snapshots.emplace_back(now->capsules().begin(), now->capsules().end());
    }
  }
  if (!save && !keep) return {};
  Shot shot = gsnav_tools::shot_of(obs.time - world.episode().start_time, obs["rgb"], obs["depth"]);
  if (save) {
    char name[64];
    std::snprintf(name, sizeof name, "/frames/ep%03d_step%04zu", episode_, step);
    const std::string base = options_.out + name;
    if (auto s = gsnav::io::save_png_rgb8(base + "_rgb.png", shot.rgb, options_.width, options_.height);
        !s)
      return s;
    if (auto s =
            gsnav::io::save_png_rgb8(base + "_depth.png", shot.depth, options_.width, options_.height);
        !s)
      return s;
  }
  if (keep) {
    std::vector<Shot>& shots = current_.shots;
    shots.push_back(std::move(shot));
    if (shots.size() > kMostShots) {  // drop every second frame of long episodes
      for (std::size_t i = 1; 2 * i < shots.size(); ++i) shots[i] = std::move(shots[2 * i]);
      shots.resize((shots.size() + 1) / 2);
      stride_ *= 2;
    }
  }
  return {};
}

void Recorder::end(const gsnav::World& world, const std::vector<gsnav::AvatarActor>& avatars) {
  if (!wanted()) return;
  const gsnav::EpisodeMetrics m = world.metrics();
  current_.interest = (m.success ? 1.0 : 0.0) + m.psi;
  if (current_.interest <= best_.interest) return;
  for (const gsnav::AvatarActor& actor : avatars) {
    std::vector<gsnav::Vec3d>& way = current_.map.avatars.emplace_back();
    for (double t = world.episode().start_time; t <= world.time(); t += 0.25)
      way.push_back(actor.placement(t).translation);
  }
  const auto now = world.bodies(world.time(), world.time());
  if (now) current_.map.snapshots.emplace_back(now->capsules().begin(), now->capsules().end());
  best_ = std::move(current_);
}

gsnav::Status Recorder::write_strip() const {
  const std::vector<Shot>& shots = best_.shots;
  const std::size_t columns = std::min<std::size_t>(8, shots.size());
  std::vector<Shot> shown;
  for (std::size_t i = 0; i < columns; ++i)
    shown.push_back(shots[columns == 1 ? 0 : i * (shots.size() - 1) / (columns - 1)]);
  const Canvas sheet = gsnav_tools::draw_strip(shown, options_.width, options_.height);
  return gsnav::io::save_png_rgb8(options_.out + "/strip.png", sheet.bytes(), sheet.width(),
                                  sheet.height());
}

gsnav::Status Recorder::finish(const gsnav::SimulatorScene& scene) {
  if (best_.shots.empty()) return {};
  if (auto s = write_strip(); !s) return s;
  MapContent& map = best_.map;
  if (!scene.assets.empty()) {
    map.cloud = scene.assets.front().cloud.get();
    map.world_from_asset = scene.assets.front().world_from_asset;
  }
  map.navmesh = scene.navmesh.get();
  const Canvas picture = draw_map(map);
  return gsnav::io::save_png_rgb8(options_.out + "/map.png", picture.bytes(), picture.width(),
                                  picture.height());
}

}  // namespace nav_loop
