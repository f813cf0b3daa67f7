// SPDX-License-Identifier: Apache-2.0
// gsnav-navmesh: builds, inspects, converts and draws NavMeshes.
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "../common/progress.hpp"
#include "draw.hpp"
#include "gsnav/backends/openmp.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/prepare.hpp"
#include "options.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_navmesh;

Result<Similarity> placement(const Options& o, const std::string& up) {
  auto placed = upright(up);
  if (placed) placed->scale = o.scale;
  return placed;
}

/// Appends the triangles of a file to `all`.
Status add_triangles(const std::string& path, const Similarity& placed, NavMeshTriangles& all) {
  auto mesh = io::load_mesh(path);
  if (!mesh) return mesh.status();
  std::printf("%s: %zu triangles\n", printable(path).c_str(), mesh->triangles.size());
  std::vector<Vec3d> vertices;
  for (const Vec3f& v : mesh->vertices) vertices.push_back(vec_cast<double>(v));
  const NavMeshPart parts[] = {{all.vertices, all.triangles, {}}, {vertices, mesh->triangles, placed}};
  auto joined = gather_parts({}, parts);
  if (!joined) return joined.status();
  all = std::move(*joined);
  return {};
}

/// Triangles of `path`, if given, and of the objects.
Result<NavMeshTriangles> load_triangles(const Options& o, const std::string& path,
                                        const Similarity& placed) {
  NavMeshTriangles all;
  if (!path.empty()) {
    if (Status s = add_triangles(path, placed, all); !s) return s;
  }
  for (const StaticObject& object : o.objects) {
    if (Status s = add_triangles(object.file, object.placed, all); !s) return s;
  }
  return all;
}

Result<NavMesh> from_triangles(const Options& o) {
  const auto placed = placement(o, o.up == "auto" ? "y" : o.up);
  if (!placed) return placed.status();
  auto mesh = load_triangles(o, o.input, *placed);
  if (!mesh) return mesh.status();
  return NavMesh::build(o.settings, mesh->vertices, mesh->triangles, o.threads);
}

/// Computes the visible sets for positions on the NavMesh, and writes them.
Status write_visible_sets(const Options& o, const GaussianCloud& cloud, const NavMesh& mesh,
                          const Similarity& placed) {
  const auto viewpoints = navmesh_viewpoints(mesh, o.eye_heights, o.visible.spacing());
  if (!viewpoints) return viewpoints.status();
  VisibleSettings settings = o.visible;
  settings.margin = settings.spacing();
  settings.progress = [print = gsnav_tools::progress_printer()](double share) {
    print("visible sets", share);
  };
  OpenMPBackend backend(o.threads);
  const auto sets = build_visible_sets(backend, cloud, *viewpoints, settings, placed);
  if (sets.code() == Errc::unsupported) {
    std::fprintf(stderr, "%s (--visible-most 1). %s is not written.\n", sets.message().c_str(),
                 printable(o.visible_sets).c_str());
    return {};
  }
  if (!sets) return sets.status();
  if (Status s = io::save_visible_sets(o.visible_sets, *sets, cloud); !s) return s;
  std::printf(
      "%s: %zu cells, from %zu viewpoints; a cell sees %.1f %% of %zu chunks, %.1f %% of the "
      "Gaussians\n",
      printable(o.visible_sets).c_str(), sets->cells(), sets->viewpoints, 100 * sets->mean_share(),
      sets->cloud_chunks, 100 * sets->mean_row_share(cloud.size()));
  return {};
}

Result<NavMesh> from_gaussians(const Options& o) {
  auto scene = io::load_scene(o.input);
  if (!scene) return scene.status();
  std::string up = o.up;
  if (up == "auto") {
    up = axis_name(scene->report.up);
    std::printf("up is %s, %s\n", up.c_str(),
                scene->report.up_seen ? "by the scene's ground" : "as usual for such files");
  }
  const auto placed_by = placement(o, up);
  if (!placed_by) return placed_by.status();
  const Similarity& placed = *placed_by;
  const GaussianSet set = scene->cloud.set(placed);
  const auto beside = load_triangles(o, o.mesh, placed);
  if (!beside) return beside.status();
  auto built =
      build_navmesh(o.settings, std::span(&set, 1), beside->vertices, beside->triangles, o.gaussians);
  if (!built) return {built.code(), o.input + ": " + built.message()};
  const GaussianNavReport& r = built->report;
  std::printf("%s: %zu Gaussians used, %zu faint, %zu outliers\n", printable(o.input).c_str(),
              r.gaussians_used, r.gaussians_faint, r.gaussians_outside);
  std::printf(
      "floor at %.3f m; %.0f %% of it under a ceiling; left out: %.2f m2 in small pieces, %.2f m2 "
      "outside\n",
      r.floor_y, 100 * r.ceiling_share, r.dropped_small, r.dropped_uncovered);
  for (const GaussianNavReport::Storey& s : r.storeys) {
    if (r.storeys.size() > 1) std::printf("storey at %.2f m: %.2f m2\n", s.height, s.area);
  }
  if (r.stairs > 0) std::printf("%zu stairs or ramps between storeys\n", r.stairs);
  if (!o.visible_sets.empty()) {
    if (Status s = write_visible_sets(o, scene->cloud, built->mesh, placed); !s) return s;
  }
  return std::move(built->mesh);
}

Result<NavMesh> make(const Options& o) {
  switch (kind_of(o.input)) {
    case InputKind::navmesh:
      return load_navmesh(o.input);
    case InputKind::mesh:
      return from_triangles(o);
    default:
      return from_gaussians(o);
  }
}

void print(const NavMesh& mesh, const std::vector<NavLevel>& levels) {
  const Aabb<double> b = mesh.bounds();
  const NavMeshSettings& s = mesh.settings();
  std::printf("%zu polygons, %.2f m2 navigable, x %.2f to %.2f, y %.2f to %.2f, z %.2f to %.2f m\n",
              mesh.polygon_count(), mesh.navigable_area(), b.low.x, b.high.x, b.low.y, b.high.y, b.low.z,
              b.high.z);
  std::printf("agent: height %g, radius %g, climb %g m, slope %g degrees; cells %g x %g m\n",
              s.agent_height, s.agent_radius, s.agent_max_climb, s.agent_max_slope, s.cell_size,
              s.cell_height);
  if (s.tile_size > 0) std::printf("tiles of %d x %d cells\n", s.tile_size, s.tile_size);
  constexpr std::size_t kShown = 10;
  for (std::size_t i = 0; i < std::min(mesh.island_count(), kShown); ++i) {
    std::printf("island %zu: %.2f m2, radius %.2f m\n", i, mesh.island_area(i), mesh.island_radius(i));
  }
  if (mesh.island_count() > kShown)
    std::printf("and %zu smaller islands\n", mesh.island_count() - kShown);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    std::printf("level %zu: at %.2f m, %.2f m2\n", i, levels[i].height, levels[i].area);
  }
}

Status draw_png(const Options& o, const NavMesh& mesh, const std::vector<NavLevel>& levels) {
  const Aabb<double> b = mesh.bounds();
  double height = 0.5 * (b.low.y + b.high.y), band = std::numeric_limits<double>::infinity();
  if (o.level && *o.level >= levels.size()) {
    return {Errc::invalid_argument, "--level " + std::to_string(*o.level) + ": there are " +
                                        std::to_string(levels.size()) + " levels"};
  }
  if (o.height) {
    height = *o.height;
    band = 0.5;
  } else if (!levels.empty()) {
    const auto most =
        std::max_element(levels.begin(), levels.end(),
                         [](const NavLevel& x, const NavLevel& y) { return x.area < y.area; });
    height = o.level ? levels[*o.level].height : most->height;
    band = 0.5 * LevelOptions{}.min_gap;
  }
  const double longer = std::max(b.high.x - b.low.x, b.high.z - b.low.z);
  constexpr double kPixels = 1200;
  const auto map =
      mesh.top_down_map(height, o.metres_per_pixel > 0 ? o.metres_per_pixel : longer / kPixels, band);
  if (!map) return map.status();
  if (std::none_of(map->islands.begin(), map->islands.end(), [](std::int32_t i) { return i >= 0; })) {
    return {Errc::nothing_navigable, "--png: nothing is walkable within " + std::to_string(band) +
                                         " m of height " + std::to_string(height) +
                                         " m; the surface spans " + std::to_string(b.low.y) + " to " +
                                         std::to_string(b.high.y) + " m"};
  }
  const double bar = bar_length(b.high.x - b.low.x);
  const MapPicture picture = draw(*map, bar);
  if (Status s = io::save_png_rgb8(o.png, picture.rgb, picture.width, picture.height); !s) return s;
  std::printf("%s: %d x %d pixels, %.4g m each, near height %.2f m; the bar is %g m\n",
              printable(o.png).c_str(), picture.width, picture.height, map->metres_per_cell, height,
              bar);
  return {};
}

Status run(const Options& o) {
  for (const std::string& out : {o.out, o.obj, o.png, o.visible_sets, o.settings_out}) {
    if (out.empty()) continue;
    if (Status s = check_output_path(out); !s) return s;
  }
  auto mesh = make(o);
  if (!mesh) return mesh.status();
  const std::vector<NavLevel> levels = find_levels(*mesh);
  print(*mesh, levels);
  if (!o.out.empty()) {
    if (Status s = save_navmesh(*mesh, o.out, o.mset_version); !s) return s;
  }
  if (!o.settings_out.empty()) {
    if (Status s = io::save_navmesh_settings(mesh->settings(), o.settings_out); !s) return s;
  }
  if (!o.obj.empty()) {
    if (Status s = save_navmesh_obj(*mesh, o.obj); !s) return s;
  }
  return o.png.empty() ? Status() : draw_png(o, *mesh, levels);
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = parse_options(argc, argv, exit_code);
  if (!options) return exit_code;
  if (const Status s = run(*options); !s) {
    std::fprintf(stderr, "gsnav-navmesh: %s\n", s.message().c_str());
    return 1;
  }
  return 0;
}
