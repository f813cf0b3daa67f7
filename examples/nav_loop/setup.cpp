// SPDX-License-Identifier: Apache-2.0
#include "setup.hpp"

#include <cstdio>
#include <utility>

namespace nav_loop {

using gsnav::Result;

std::vector<gsnav::SensorSpec> sensors_of(const Options& options) {
  return gsnav::rgbd_sensors(options.height, options.width, options.hfov, {0, options.eye_height, 0});
}

Result<Setup> prepare(const Options& options) {
  gsnav::OpenOptions how = gsnav_tools::open_options(options);
  how.eye = gsnav::sensor_camera(sensors_of(options)[0], {}, {});
  gsnav_tools::print_device(options.device, stderr);
  auto opened = gsnav_tools::open_scene(options, how, stderr);
  if (!opened) return opened.status();
  const gsnav::SimulatorScene& scene = *opened->scene;
  Setup setup;
  setup.scene = opened->scene;
  setup.detail = gsnav_tools::detail_of(options, *opened);
  setup.timings.load = opened->load_seconds;
  setup.timings.navmesh = opened->navmesh_seconds;
  SceneFacts& facts = setup.facts;
  facts.name = opened->name;
  facts.gaussians = opened->report.kept;
  facts.navmesh_source = opened->navmesh_source;
  facts.navmesh_polygons = scene.navmesh->polygon_count();
  facts.islands = scene.navmesh->island_count();
  facts.area = scene.navmesh->navigable_area();
  facts.island_area = scene.navmesh->island_area(0);
  facts.avatars = scene.avatars.size();
  if (facts.avatars > 0) facts.avatar_gaussians = scene.avatars.front().asset()->size();
  return setup;
}

Result<std::vector<gsnav::PointNavEpisode>> make_episodes(const Options& options,
                                                          const gsnav::SimulatorScene& scene,
                                                          const gsnav::TaskConfig& task) {
  auto episodes =
      gsnav::generate_episodes(*scene.navmesh, static_cast<std::size_t>(options.episodes), options.seed);
  if (!episodes) return episodes;
  if (gsnav::Status s = gsnav::draw_start_times(*episodes, scene, task, options.seed); !s) return s;
  return episodes;
}

}  // namespace nav_loop
