// SPDX-License-Identifier: Apache-2.0
#include "pictures.hpp"

#include <algorithm>

#include "../common/canvas.hpp"
#include "../common/map.hpp"
#include "../common/strip.hpp"
#include "gsnav/io/image_file.hpp"

namespace gsnav_eval {
namespace {

using gsnav::Result;
using gsnav::Status;
constexpr std::size_t kShots = 4;

}  // namespace

Result<Simulator> make_simulator(const Options& options, const Stage& stage) {
  return Simulator::create(options.device, stage.scene, stage.config);
}

Status draw(Simulator& sim, const Stage& stage, const Record& record, const std::filesystem::path& strip,
            const std::filesystem::path& map_file) {
  const gsnav::PointNavEpisode& episode = stage.episodes[record.episode];
  const gsnav::SensorSpec& sensor = stage.config.sensors.front();
  const int h = sensor.resolution[0], w = sensor.resolution[1];
  std::vector<gsnav_tools::Shot> shots;
  gsnav_tools::MapContent map;
  map.navmesh = stage.scene->navmesh.get();
  map.goal = episode.goal_position;
  map.agent_radius = stage.config.task.agent_radius;
  if (!stage.scene->assets.empty()) {
    map.cloud = stage.scene->assets.front().cloud.get();
    map.world_from_asset = stage.scene->assets.front().world_from_asset;
  }
  map.avatars.resize(stage.scene->avatars.size());
  const std::size_t last = record.actions.size();
  const auto look = [&](Simulator& s, std::size_t step) -> Status {
    const gsnav::World& world = s.world();
    if (step == 0) {
      map.start = world.agent().position;
      if (const auto path = world.navmesh().find_path(map.start, map.goal)) map.shortest = path->points;
    }
    map.agent.push_back(world.agent().position);
    for (std::size_t i = 0; i < map.avatars.size(); ++i) {
      map.avatars[i].push_back(stage.scene->avatars[i].placement(world.time()).translation);
    }
    if (step % 8 == 0 || step == last) {
      const auto now = world.bodies(world.time(), world.time());
      if (now) map.snapshots.emplace_back(now->capsules().begin(), now->capsules().end());
    }
    for (std::size_t k = 0; k < kShots; ++k) {
      if (k * last / (kShots - 1) != step) continue;
      s.set_rendering(true);
      const auto obs = s.observe();
      s.set_rendering(false);
      if (!obs) return obs.status();
      shots.push_back(
          gsnav_tools::shot_of(obs->time - episode.start_time, (*obs)["rgb"], (*obs)["depth"]));
    }
    return {};
  };
  if (Status s = replay(sim, episode, record, look); !s) return s;
  const gsnav_tools::Canvas sheet = gsnav_tools::draw_strip(shots, w, h);
  if (Status s = gsnav::io::save_png_rgb8(strip, sheet.bytes(), sheet.width(), sheet.height()); !s)
    return s;
  const gsnav_tools::Canvas picture = draw_map(map);
  return gsnav::io::save_png_rgb8(map_file, picture.bytes(), picture.width(), picture.height());
}

}  // namespace gsnav_eval
