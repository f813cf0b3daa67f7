// SPDX-License-Identifier: Apache-2.0
#include "bench_nav_scenes.hpp"

#include <cmath>
#include <ctime>
#include <span>
#include <string>
#include <utility>

#include "gsnav/detail/demo/default_scene.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "navmesh_impl.hpp"

namespace gsnav_bench {

Scene::Scene(NavMesh m) : mesh(std::make_unique<NavMesh>(std::move(m))) {
  Rng rng(1);
  for (int i = 0; i < 4096; ++i) {
    points.push_back(mesh->random_point(rng));
    goals.push_back(mesh->random_point(rng, mesh->island_of(points.back().poly)));
    main_points.push_back(mesh->random_point(rng, 0));
    positions.push_back(points.back().position);
    goal_positions.push_back(goals.back().position);
  }
  constexpr int kNodes = 65535;
  detour->init(mesh->impl().mesh.get(), kNodes);
  const std::clock_t begin = std::clock();
  (void)mesh->distance_between(points[0], goals[0]);  // fills tables for all later queries
  prepare_ms = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  while (near_points.size() < 4096) {
    const NavPoint a = mesh->random_point(rng);
    const auto b = mesh->random_point_near(rng, a.position, 30.0, mesh->island_of(a.poly));
    const double d = b ? mesh->distance_between(a, *b) : 0.0;
    if (d < 1 || d > 30) continue;
    near_points.push_back(a);
    near_goals.push_back(*b);
  }
  const Vec3d goal = main_points[0].position;
  field = std::make_unique<GeodesicField>(GeodesicField::make(*mesh, std::span(&goal, 1)).value());
  // 16 walks. Each is a point that turns a little at every step, and also where it meets a wall.
  for (std::size_t i = 0; i < 16; ++i) {
    NavPoint at = main_points[i];
    double heading = rng.uniform(0, 6.28);
    for (int k = 0; k < 256; ++k) {
      const SurfaceWalk w =
          mesh->walk(at, Vec3d{0.25 * std::cos(heading), 0, 0.25 * std::sin(heading)}, true);
      if (!w.points.empty()) at = {w.points.back().position, w.points.back().poly};
      heading += w.hit_wall ? rng.uniform(1, 5) : rng.uniform(-0.2, 0.2);
      walk.push_back(at);
    }
  }
}

namespace {

/// A mesh of the data folder, built with Habitat's settings; null if the folder does not have it.
const Scene* data(const char* name) {
  const auto mesh = io::load_mesh(std::string(GSNAV_DATA_DIR "/nav/") + name);
  if (!mesh) return nullptr;
  std::vector<Vec3d> vertices;
  for (const Vec3f& v : mesh->vertices) vertices.push_back(vec_cast<double>(v));
  return new Scene(NavMesh::build({}, vertices, mesh->triangles).value());
}

}  // namespace

const Scene* flat() {
  static const Scene scene([] {
    const DefaultScene s = make_default_scene(0.1).value();
    return NavMesh::build({}, s.vertices, s.triangles).value();
  }());
  return &scene;
}

const Scene* nav_test() {
  static const Scene* scene = data("recast/nav_test.obj");
  return scene;
}
const Scene* dungeon() {
  static const Scene* scene = data("recast/dungeon.obj");
  return scene;
}
const Scene* undulating() {
  static const Scene* scene = data("recast/undulating.obj");
  return scene;
}

const Scene* terrain() {
  static const Scene* scene = data("glb/terrain.glb");
  return scene;
}

}  // namespace gsnav_bench
