// SPDX-License-Identifier: Apache-2.0
// Builds a NavMesh from the Gaussians of a scan, finds a shortest path on it and draws a map.
// usage: navmesh_from_scan [SCENE]; writes scan.navmesh and map.png
#include <cstdint>
#include <cstdio>
#include <vector>

#include "gsnav/io.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/open.hpp"

int main(int argc, char** argv) try {
  // [snippet: build]
  // An agent with a radius of 0.2 m and a height of 1.5 m, and voxels of 0.05 m.
  gsnav::OpenOptions options{.navmesh = "gaussians", .agent_radius = 0.2};
  auto scene = gsnav::open_scene(argc > 1 ? argv[1] : "default", options).value();
  const gsnav::NavMesh& mesh = *scene.scene->navmesh;
  std::printf("%.1f square metres, islands: %zu\n", mesh.navigable_area(), mesh.island_count());
  gsnav::save_navmesh(mesh, "scan.navmesh").throw_if_error();
  // [/snippet]

  // [snippet: path]
  gsnav::Rng rng(1);
  auto start = mesh.random_point(rng, 0), goal = mesh.random_point(rng, 0);  // on island 0, the largest
  auto path = mesh.path_between(start, goal).value();
  for (const gsnav::Vec3d& p : path.points) std::printf("(%.2f, %.2f, %.2f)\n", p.x, p.y, p.z);
  std::printf("length %.2f metres\n", path.length);
  // [/snippet]

  // [snippet: map]
  // Cells of 0.05 m at the height of the start. Black is blocked, white is island 0, grey is another.
  auto map = mesh.top_down_map(start.position.y, 0.05).value();
  std::vector<std::uint8_t> pixels;
  for (std::int32_t island : map.islands) {
    const std::uint8_t shade = island == 0 ? 255 : island > 0 ? 128 : 0;
    pixels.insert(pixels.end(), 3, shade);
  }
  const int columns = static_cast<int>(map.columns), rows = static_cast<int>(map.rows);
  gsnav::io::save_png_rgb8("map.png", pixels, columns, rows).throw_if_error();
  // [/snippet]
} catch (const std::exception& e) {
  return std::fprintf(stderr, "%s\n", e.what()), 1;
}
