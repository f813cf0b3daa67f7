// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/demo/people.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/avatar/trajectory.hpp"
#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"

namespace gsnav {
namespace {

constexpr double kRound = 48.0;     // seconds after which everyone is back at the start of their path
constexpr double kApart = 0.75;     // metres between two people, root to root, where possible
constexpr double kUsualPace = 1.0;  // metres per second

/// The path of a person, and its speed.
struct PersonPath {
  std::vector<Vec3d> points;
  WalkOptions walk;
  WalkTrajectory trajectory;
};

std::optional<PersonPath> make_way(const std::vector<Vec3d>& points, double speed) {
  WalkOptions walk;
  walk.speed = speed;
  auto trajectory = WalkTrajectory::create(points, walk);
  if (!trajectory) return {};
  return PersonPath{points, walk, std::move(*trajectory)};
}

/// A path through random places, walked back and forth in `kRound` seconds. Nothing if the random path
/// would need too high or too low a speed.
std::optional<PersonPath> random_way(const NavMesh& mesh, Rng& rng) {
  std::vector<Vec3d> points{mesh.random_point(rng, 0).position};
  double length = 0;
  for (int tries = 0; tries < 40 && length < 0.40 * kRound * kUsualPace; ++tries) {
    const auto path = mesh.find_path(points.back(), mesh.random_point(rng, 0).position);
    if (!path || path->length < 1.0) continue;
    length += path->length;
    points.insert(points.end(), path->points.begin() + 1, path->points.end());
  }
  double speed = kUsualPace;
  for (int i = 0; i < 30; ++i) {  // turns on the spot take time too, so find the speed by iteration
    auto way = make_way(points, speed);
    if (!way || !(way->trajectory.period() > 0) || speed < 0.6 || speed > 1.4) return {};
    if (std::abs(way->trajectory.period() - kRound) < 1e-9) return way;
    speed *= way->trajectory.period() / kRound;
  }
  return {};
}

double closest(const PersonPath& a, const std::vector<PersonPath>& others) {
  double least = std::numeric_limits<double>::infinity();
  for (const PersonPath& b : others) {
    for (double t = 0; t < kRound; t += 0.2) {
      least = std::min(least, norm(a.trajectory.at(t).position - b.trajectory.at(t).position));
    }
  }
  return least;
}

Status check_people(const char* subject, const char* field, std::size_t count) {
  return detail::FieldCheck(subject).in(field, count, 0, static_cast<double>(kMaxPeople)).status();
}

/// A flat with its NavMesh, and people who walk in it.
Result<SimulatorScene> inhabited(Result<DefaultScene> flat, std::size_t people, std::uint64_t seed,
                                 double people_density, const TaskConfig& task,
                                 const std::function<void(double)>& progress) {
  if (!flat) return flat.status();
  const auto build = [&](double radius, double height) {
    NavMeshSettings settings;
    settings.agent_radius = radius;
    settings.agent_height = height;
    return NavMesh::build(settings, flat->vertices, flat->triangles);
  };
  auto mesh = build(task.agent_radius, task.agent_height);
  if (!mesh) return mesh.status();
  SimulatorScene scene;
  if (flat->painted.geometry.triangles.empty()) {
    scene.assets.push_back({std::make_shared<const GaussianCloud>(std::move(flat->cloud)), {}});
  } else {
    TexturedScene surface;
    surface.parts.push_back(std::move(flat->painted));
    surface.instances.push_back({});
    auto placed = placed_meshes(std::move(surface));
    if (!placed) return placed.status();
    scene.meshes.push_back({std::make_shared<const PlacedMeshes>(std::move(*placed)), {}});
  }
  scene.navmesh = std::make_shared<const NavMesh>(std::move(*mesh));
  if (people == 0) return scene;
  const auto walkways = build(0.3, 1.8);
  if (!walkways) return walkways.status();
  auto actors = walking_people(*walkways, people, seed, people_density, progress);
  if (!actors) return actors.status();
  scene.avatars = std::move(*actors);
  return scene;
}

}  // namespace

Vec3d person_color(std::size_t index) noexcept {
  static constexpr std::array<Vec3d, 6> kColors{{{0.90, 0.45, 0.05},
                                                 {0.55, 0.15, 0.65},
                                                 {0.05, 0.55, 0.50},
                                                 {0.75, 0.10, 0.40},
                                                 {0.45, 0.45, 0.05},
                                                 {0.35, 0.25, 0.15}}};
  return kColors[index % kColors.size()];
}

Result<std::vector<AvatarActor>> walking_people(const NavMesh& walkways, std::size_t count,
                                                std::uint64_t seed, double density,
                                                const std::function<void(double)>& progress) {
  if (Status s = check_people("walking_people: ", "count", count); !s) return s;
  if (!std::isfinite(density)) return {Errc::invalid_argument, "walking_people: density is not finite"};
  std::vector<PersonPath> ways;
  std::vector<AvatarActor> people;
  Rng rng(seed ^ 0x70656f706c65ull);
  for (std::size_t i = 0; i < count; ++i) {
    if (progress) progress(static_cast<double>(i) / static_cast<double>(count));
    std::optional<PersonPath> best;
    double best_distance = -1;
    for (int tries = 0; tries < 80 && best_distance < kApart; ++tries) {
      auto way = random_way(walkways, rng);
      if (!way) continue;
      const double d = closest(*way, ways);
      if (d > best_distance) {
        best_distance = d;
        best = std::move(way);
      }
    }
    if (!best) best = make_way({walkways.random_point(rng, std::size_t{0}).position}, kUsualPace);
    if (!best) return {Errc::nothing_navigable, "no place for an avatar"};
    HumanoidOptions look = random_person(static_cast<std::uint64_t>(i) + 1);
    look.gaussians = static_cast<int>(std::clamp(density * look.gaussians, 2000.0, 400000.0));
    look.top = person_color(i) * 0.72 + Vec3d{0.10, 0.10, 0.10};
    auto body = try_make_humanoid(look);
    if (!body) return body.status();
    auto actor =
        make_walker(std::make_shared<const AvatarAsset>(std::move(*body)), best->points, best->walk);
    if (!actor) return actor.status();
    people.push_back(std::move(*actor));
    ways.push_back(std::move(*best));
  }
  return people;
}

Result<SimulatorScene> default_simulator_scene(std::size_t people, std::uint64_t seed, double density,
                                               const TaskConfig& task,
                                               const std::function<void(double)>& progress) {
  if (Status s = check_people("default_simulator_scene: ", "people", people); !s) return s;
  return inhabited(make_default_scene(density), people, seed, 1.0, task, progress);
}

Result<SimulatorScene> planned_simulator_scene(const FloorPlanOptions& plan, std::size_t people,
                                               std::uint64_t seed, double density,
                                               const TaskConfig& task, SurfaceKind kind,
                                               const std::function<void(double)>& progress) {
  if (Status s = check_people("planned_simulator_scene: ", "people", people); !s) return s;
  const auto drawn = make_floor_plan(plan);
  if (!drawn) return drawn.status();
  SceneSampling sampling;
  sampling.density = density;
  sampling.kind = kind;
  return inhabited(make_planned_scene(*drawn, sampling), people, seed, density, task, progress);
}

}  // namespace gsnav
