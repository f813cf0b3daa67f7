// SPDX-License-Identifier: Apache-2.0
#include "setup.hpp"

#include <chrono>
#include <cstdio>
#include <optional>

#include "gsnav/core/printable.hpp"
#include "gsnav/demo.hpp"
#include "gsnav/device/renderer.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/render.hpp"
#include "gsnav/scene/prepare.hpp"
#include "gsnav/sim.hpp"

namespace nav_loop {
namespace {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Vec3d;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

/// Levels of detail: those beside the scene's file, or built; the embedded flat's are built.
Result<gsnav::LodTree> levels_of(const Options& options, const gsnav::GaussianCloud& cloud) {
  const auto build = [&] { return gsnav::build_lod(options.device, cloud); };
  if (options.scene.empty()) return build();
  auto cached = gsnav::io::cached_lod(options.scene, cloud, {}, build);
  if (!cached) return cached.status();
  if (!cached->warning.empty()) std::fprintf(stderr, "%s\n", cached->warning.c_str());
  return std::move(cached->tree);
}

/// What is seen from where the agent's eyes can be: read from beside the scene's file, or found; the
/// embedded flat's is found.
Result<gsnav::VisibleSets> visible_sets_of(const Options& options, const gsnav::SceneAsset& asset,
                                           const gsnav::NavMesh& navmesh) {
  const gsnav::Camera eye = gsnav::sensor_camera(sensors_of(options)[0], {}, {});
  gsnav::VisibleSettings settings;
  settings.serve(eye);
  settings.progress = visible_progress();
  const double heights[] = {options.eye_height};
  const auto viewpoints = gsnav::navmesh_viewpoints(navmesh, heights, settings.spacing());
  if (!viewpoints) return viewpoints.status();
  const auto build = [&] {
    return gsnav::build_visible_sets(options.device, *asset.cloud, *viewpoints, settings,
                                     asset.world_from_asset);
  };
  if (options.scene.empty()) return build();
  auto cached = gsnav::io::cached_visible_sets(options.scene, *asset.cloud, *viewpoints, settings,
                                               asset.world_from_asset, build);
  if (!cached) return cached.status();
  if (!cached->warning.empty()) std::fprintf(stderr, "%s\n", cached->warning.c_str());
  return std::move(cached->sets);
}

/// Lets go of SH bands that cannot be seen.
void fit_storage(gsnav::GaussianCloud& cloud, double unseen) {
  gsnav::SceneBands profile = gsnav::scene_bands(cloud, unseen);
  gsnav::drop_bands(cloud, profile);
}

}  // namespace

std::vector<gsnav::SensorSpec> sensors_of(const Options& options) {
  return gsnav::rgbd_sensors(options.height, options.width, options.hfov, {0, options.eye_height, 0});
}

Result<Setup> prepare(const Options& options) {
  Setup setup;
  setup.facts.name = options.scene.empty() ? "embedded flat" : options.scene;
  std::vector<Vec3d> vertices;
  std::vector<gsnav::NavMesh::Triangle> triangles;

  auto from = Clock::now();
  gsnav::SceneAsset asset;
  gsnav::GaussianCloud cloud;
  std::optional<gsnav::LodTree> levels;
  if (options.scene.empty()) {
    auto flat = gsnav::make_default_scene(options.density);
    if (!flat) return flat.status();
    cloud = std::move(flat->cloud);
    vertices = std::move(flat->vertices);
    triangles = std::move(flat->triangles);
  } else {
    std::optional<gsnav::io::LoadedLodSet> shipped;
    if (options.profile == "lod") {
      auto set = gsnav::io::load_shipped_levels(options.scene);
      if (!set) return set.status();
      shipped = std::move(*set);
    }
    if (shipped) {
      for (const std::string& w : shipped->report.warnings)
        std::fprintf(stderr, "%s\n", gsnav::printable(w).c_str());
      cloud = std::move(shipped->cloud);
      levels = std::move(shipped->tree);
    } else {
      auto loaded = gsnav::io::load_scene(options.scene);
      if (!loaded) return loaded.status();
      for (const std::string& w : loaded->report.warnings)
        std::fprintf(stderr, "%s\n", gsnav::printable(w).c_str());
      cloud = std::move(loaded->cloud);
    }
    const auto up = upright(options.up);
    if (!up) return up.status();
    asset.world_from_asset = *up;
  }
  if (options.profile == "lod" && !levels) {
    auto tree = levels_of(options, cloud);
    if (!tree) return tree.status();
    levels = std::move(*tree);
  }
  const double unseen = options.profile == "exact" ? 0 : gsnav::kUnseenColor;
  fit_storage(cloud, unseen);
  if (levels) {
    fit_storage(levels->merged, unseen);
    asset.lod = std::make_shared<const gsnav::LodTree>(std::move(*levels));
  }
  asset.cloud = std::make_shared<const gsnav::GaussianCloud>(std::move(cloud));
  setup.timings.load = seconds_since(from);
  setup.facts.gaussians = asset.cloud->size();
  setup.scene.assets.push_back(asset);

  from = Clock::now();
  const bool ready = options.ready_made();
  const bool from_mesh = !ready && !triangles.empty() && options.navmesh != "gaussians";
  if (!from_mesh && options.navmesh == "mesh")
    return {Errc::invalid_argument, "--navmesh mesh: only the embedded flat has a mesh"};
  const auto build = [&](double radius, double height, const char* name) -> Result<gsnav::NavMesh> {
    gsnav::NavMeshSettings settings =
        from_mesh ? gsnav::NavMeshSettings{} : gsnav::gaussian_navmesh_settings();
    settings.agent_radius = radius;
    settings.agent_height = height;
    gsnav::GaussianNavOptions how;
    if (from_mesh) {
      settings.cell_size = options.cell_size;
      return gsnav::NavMesh::build(settings, vertices, triangles);
    }
    apply(options.cell_size, options.crop, settings, how, name);
    if (options.scene.empty()) how.solid_alpha = 0.2;  // the flat's surfaces are as thin as paper
    const gsnav::GaussianSet set = asset.cloud->set(asset.world_from_asset);
    auto built = gsnav::build_navmesh(settings, std::span(&set, 1), how);
    if (!built) return {built.code(), setup.facts.name + ": " + built.message()};
    return std::move(built->mesh);
  };
  auto mesh = ready ? gsnav::load_navmesh(options.navmesh) : build(0.1, 1.5, "NavMesh");
  if (!mesh) return mesh.status();
  setup.scene.navmesh = std::make_shared<const gsnav::NavMesh>(std::move(*mesh));
  setup.timings.navmesh = seconds_since(from);
  if (options.visible_sets) {
    auto visible = visible_sets_of(options, setup.scene.assets[0], *setup.scene.navmesh);
    if (!visible && visible.code() != Errc::unsupported) return visible.status();
    if (!visible) std::fprintf(stderr, "%s: drawn without them\n", visible.message().c_str());
    if (visible)
      std::printf(
          "visible sets: %zu cells, from %zu viewpoints; a cell sees %.1f %% of %zu chunks, %.1f %% of "
          "the Gaussians\n",
          visible->cells(), visible->viewpoints, 100 * visible->mean_share(), visible->cloud_chunks,
          100 * visible->mean_row_share(setup.scene.assets[0].cloud->size()));
    if (visible)
      setup.scene.assets[0].visible = std::make_shared<const gsnav::VisibleSets>(std::move(*visible));
  }
  // People are wider than the agent: they keep their shoulders clear of the furniture.
  std::optional<gsnav::NavMesh> walkways;
  if (options.avatars > 0 && !ready) {
    if (auto wide = build(0.3, 1.8, "NavMesh of people"); wide) walkways = std::move(*wide);
  }
  const gsnav::NavMesh& nav = *setup.scene.navmesh;
  setup.facts.navmesh_source = ready       ? "from " + options.navmesh
                               : from_mesh ? "from the mesh"
                                           : "from the Gaussians";
  setup.facts.navmesh_polygons = nav.polygon_count();
  setup.facts.islands = nav.island_count();
  setup.facts.area = nav.navigable_area();
  setup.facts.island_area = nav.island_count() > 0 ? nav.island_area(0) : 0.0;
  if (options.avatars > 0) {
    auto people =
        gsnav::walking_people(walkways ? *walkways : *setup.scene.navmesh,
                              static_cast<std::size_t>(options.avatars), options.seed, options.density);
    if (!people) return people.status();
    setup.scene.avatars = std::move(*people);
    setup.facts.avatar_gaussians = setup.scene.avatars.front().asset()->size();
  }
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
