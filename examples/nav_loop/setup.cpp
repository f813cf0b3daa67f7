// SPDX-License-Identifier: Apache-2.0
#include "setup.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "gsnav/avatar/avatar.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/nav/gaussian_navmesh.hpp"
#include "gsnav/sim/default_scene.hpp"
#include "map.hpp"

namespace nav_loop {
namespace {

using gsnav::Errc;
using gsnav::Result;
using gsnav::Vec3d;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

constexpr double kRound = 48.0;     // seconds: everybody is back at the start of their way after that
constexpr double kApart = 0.75;     // metres between two people, root to root, where it can be had
constexpr double kUsualPace = 1.0;  // metres a second

/// Where somebody goes, and how fast.
struct Way {
  std::vector<Vec3d> points;
  gsnav::WalkOptions walk;
  gsnav::WalkTrajectory trajectory;
};

std::optional<Way> make_way(const std::vector<Vec3d>& points, double speed) {
  gsnav::WalkOptions walk;
  walk.speed = speed;
  auto trajectory = gsnav::WalkTrajectory::create(points, walk);
  if (!trajectory) return {};
  return Way{points, walk, std::move(*trajectory)};
}

/// A way through random places, walked back and forth in `kRound` seconds. None where chance gave a way
/// that would have to be walked too fast or too slowly.
std::optional<Way> random_way(const gsnav::NavMesh& mesh, gsnav::Rng& rng) {
  std::vector<Vec3d> points{mesh.random_point(rng, 0).position};
  double length = 0;
  for (int tries = 0; tries < 40 && length < 0.40 * kRound * kUsualPace; ++tries) {
    const auto path = mesh.find_path(points.back(), mesh.random_point(rng, 0).position);
    if (!path || path->length < 1.0) continue;
    length += path->length;
    points.insert(points.end(), path->points.begin() + 1, path->points.end());
  }
  double speed = kUsualPace;
  for (int i = 0; i < 30; ++i) {  // turns on the spot take their own time: the speed is found by trial
    auto way = make_way(points, speed);
    if (!way || !(way->trajectory.period() > 0) || speed < 0.6 || speed > 1.4) return {};
    if (std::abs(way->trajectory.period() - kRound) < 1e-9) return way;
    speed *= way->trajectory.period() / kRound;
  }
  return {};
}

double closest(const Way& a, const std::vector<Way>& others) {
  double least = std::numeric_limits<double>::infinity();
  for (const Way& b : others) {
    for (double t = 0; t < kRound; t += 0.2) {
      least = std::min(least, gsnav::norm(a.trajectory.at(t).position - b.trajectory.at(t).position));
    }
  }
  return least;
}

/// People on random ways. Ways are drawn until one keeps apart from those before it: all have one
/// period, so what holds for one round holds for ever.
Result<std::vector<gsnav::AvatarActor>> spawn_avatars(const Options& options,
                                                      const gsnav::NavMesh& mesh) {
  std::vector<Way> ways;
  std::vector<gsnav::AvatarActor> people;
  gsnav::Rng rng(options.seed ^ 0x70656f706c65ull);
  for (int i = 0; i < options.avatars; ++i) {
    std::optional<Way> best;
    double best_distance = -1;
    for (int tries = 0; tries < 80 && best_distance < kApart; ++tries) {
      auto way = random_way(mesh, rng);
      if (!way) continue;
      const double d = closest(*way, ways);
      if (d > best_distance) {
        best_distance = d;
        best = std::move(way);
      }
    }
    if (!best) best = make_way({mesh.random_point(rng, 0).position}, kUsualPace);
    if (!best) return {Errc::nothing_navigable, "no place for an avatar"};
    gsnav::HumanoidOptions look = gsnav::random_person(static_cast<std::uint64_t>(i) + 1);
    const Rgb color = avatar_color(static_cast<std::size_t>(i));  // as in the map
    look.top = Vec3d{color.r, color.g, color.b} * 0.72 + Vec3d{0.10, 0.10, 0.10};
    auto body = gsnav::try_make_humanoid(look);
    if (!body) return body.status();
    auto actor = gsnav::make_walker(std::make_shared<const gsnav::AvatarAsset>(std::move(*body)),
                                    best->points, best->walk);
    if (!actor) return actor.status();
    people.push_back(std::move(*actor));
    ways.push_back(std::move(*best));
  }
  return people;
}

}  // namespace

Result<Setup> prepare(const Options& options) {
  Setup setup;
  setup.facts.backend = options.backend;
  setup.facts.name = options.scene.empty() ? "embedded flat" : options.scene;
  std::vector<Vec3d> vertices;
  std::vector<gsnav::NavMesh::Triangle> triangles;

  auto from = Clock::now();
  gsnav::SceneAsset asset;
  if (options.scene.empty()) {
    auto flat = gsnav::make_default_scene();
    if (!flat) return flat.status();
    asset.cloud = std::make_shared<gsnav::GaussianCloud>(std::move(flat->cloud));
    vertices = std::move(flat->vertices);
    triangles = std::move(flat->triangles);
  } else {
    auto loaded = gsnav::io::load_scene(options.scene);
    if (!loaded) return loaded.status();
    for (const std::string& w : loaded->report.warnings) std::fprintf(stderr, "%s\n", w.c_str());
    asset.cloud = std::make_shared<gsnav::GaussianCloud>(std::move(loaded->cloud));
    const auto up = upright(options.up);
    if (!up) return up.status();
    asset.world_from_asset = *up;
  }
  setup.timings.load = seconds_since(from);
  setup.facts.gaussians = asset.cloud->size();
  setup.scene.assets.push_back(asset);

  from = Clock::now();
  const bool from_mesh = !triangles.empty() && options.navmesh != "gaussians";
  if (!from_mesh && options.navmesh == "mesh")
    return {Errc::invalid_argument, "--navmesh mesh: only the embedded flat has a mesh"};
  const auto build = [&](double radius, double height) -> Result<gsnav::NavMesh> {
    gsnav::NavMeshSettings settings =
        from_mesh ? gsnav::NavMeshSettings{} : gsnav::gaussian_navmesh_settings();
    settings.agent_radius = radius;
    settings.agent_height = height;
    if (from_mesh) return gsnav::NavMesh::build(settings, vertices, triangles);
    gsnav::GaussianNavOptions how;
    if (options.scene.empty()) how.solid_alpha = 0.2;  // the flat's surfaces are as thin as paper
    const gsnav::GaussianSet set = asset.cloud->set(asset.world_from_asset);
    auto built = gsnav::build_navmesh(settings, std::span(&set, 1), how);
    if (!built) return built.status();
    return std::move(built->mesh);
  };
  auto mesh = build(0.1, 1.5);
  if (!mesh) return mesh.status();
  setup.scene.navmesh = std::make_shared<const gsnav::NavMesh>(std::move(*mesh));
  setup.timings.navmesh = seconds_since(from);
  // People are wider than the agent: they keep their shoulders clear of the furniture.
  std::optional<gsnav::NavMesh> walkways;
  if (options.avatars > 0) {
    if (auto wide = build(0.3, 1.8); wide) walkways = std::move(*wide);
  }
  const gsnav::NavMesh& nav = *setup.scene.navmesh;
  setup.facts.navmesh_source = from_mesh ? "from the mesh" : "from the Gaussians";
  setup.facts.navmesh_polygons = nav.polygon_count();
  setup.facts.islands = nav.island_count();
  setup.facts.area = nav.navigable_area();
  setup.facts.island_area = nav.island_count() > 0 ? nav.island_area(0) : 0.0;
  if (options.avatars > 0) {
    auto people = spawn_avatars(options, walkways ? *walkways : *setup.scene.navmesh);
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
  gsnav::Rng rng(options.seed ^ 0x7469636bull);
  for (gsnav::PointNavEpisode& e : *episodes) {
    for (int tries = 0; tries < 100; ++tries) {
      e.start_time = rng.uniform(0.0, 600.0);
      std::vector<gsnav::DynamicCapsule> now;
      for (std::size_t i = 0; i < scene.avatars.size(); ++i) {
        scene.avatars[i].dynamic_capsules(e.start_time, e.start_time, static_cast<std::uint32_t>(i),
                                          now);
      }
      const auto bodies = gsnav::CapsuleSet::create(std::move(now), e.start_time, e.start_time);
      if (!bodies) return bodies.status();
      if (gsnav::clearance({e.start_position, task.agent_radius, task.agent_height}, *bodies,
                           e.start_time)
              .distance > 0.6)
        break;
    }
  }
  return episodes;
}

}  // namespace nav_loop
