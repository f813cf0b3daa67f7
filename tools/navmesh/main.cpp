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
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/open.hpp"
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

/// Adds the triangles of the objects in the scene.
Status add_objects(const Options& o, NavMeshTriangles& all) {
  for (const StaticObject& object : o.objects) {
    if (Status s = add_triangles(object.file, object.placed, all); !s) return s;
  }
  return {};
}

Result<NavMesh> build(const Options& o, const NavMeshTriangles& all) {
  return NavMesh::build(o.settings, all.vertices, all.triangles, o.threads,
                        [&o](double share) { o.gaussians.progress("triangles", share); });
}

Result<NavMesh> from_triangles(const Options& o) {
  const auto placed = placement(o, o.up == "auto" || o.up == "keep" ? "y" : o.up);
  if (!placed) return placed.status();
  NavMeshTriangles all;
  if (Status s = add_triangles(o.scene, *placed, all); !s) return s;
  if (Status s = add_objects(o, all); !s) return s;
  return build(o, all);
}

/// The device of --device. --threads holds for `cpu`, too.
Device device_of(const Options& o) {
  if (o.threads == 0 || o.device.kind() != DeviceKind::cpu || o.device.threads() != 0) return o.device;
  return Device::parse("cpu:" + std::to_string(o.threads)).value();
}

/// Computes the visible sets for positions on the NavMesh, and writes them.
Status write_visible_sets(const Options& o, const GaussianCloud& cloud, const NavMesh& mesh,
                          const Similarity& placed) {
  const auto viewpoints = navmesh_viewpoints(mesh, o.eye_heights, o.visible.spacing());
  if (!viewpoints) return viewpoints.status();
  VisibleSettings settings = o.visible;
  settings.margin = settings.cell;
  settings.progress = [print = gsnav_tools::progress_printer()](double share) {
    print("visible sets", share);
  };
  const auto sets = build_visible_sets(device_of(o), cloud, *viewpoints, settings, placed);
  if (!sets) return sets.status();
  if (sets->refused_share > 0) {
    std::fprintf(stderr,
                 "visible sets gain nothing here, because a cell sees %.0f %% of the Gaussians on "
                 "average, more than --visible-most. %s is not written.\n",
                 100 * sets->refused_share, printable(o.visible_sets).c_str());
    return {};
  }
  if (Status s = io::save_visible_sets(o.visible_sets, *sets, cloud); !s) return s;
  std::printf(
      "%s: %zu cells, from %zu viewpoints; a cell sees %.1f %% of %zu chunks, %.1f %% of the "
      "Gaussians\n",
      printable(o.visible_sets).c_str(), sets->cells(), sets->viewpoints, 100 * sets->mean_share(),
      sets->cloud_chunks, 100 * sets->mean_row_share(cloud.size()));
  return {};
}

void print(const std::string& name, const GaussianNavReport& r) {
  std::printf("%s: %zu Gaussians used, %zu faint, %zu outliers\n", printable(name).c_str(),
              r.gaussians_used, r.gaussians_faint, r.gaussians_outside);
  std::printf(
      "floor at %.3f m; %.0f %% of it under a ceiling; left out: %.2f m2 in small pieces, %.2f m2 "
      "outside\n",
      r.floor_y, 100 * r.ceiling_share, r.dropped_small, r.dropped_uncovered);
  for (const GaussianNavReport::Storey& s : r.storeys) {
    if (r.storeys.size() > 1) std::printf("storey at %.2f m: %.2f m2\n", s.height, s.area);
  }
  if (r.stairs > 0) std::printf("%zu stairs or ramps between storeys\n", r.stairs);
}

/// `beside`: triangles that stand among the Gaussians.
Result<NavMesh> from_gaussians(const Options& o, const GaussianSet& set,
                               const NavMeshTriangles& beside) {
  NavMeshSettings settings = o.settings;
  if (!o.cell_height_given)
    settings.cell_height = std::max(gaussian_navmesh_settings().cell_height, settings.cell_size);
  GaussianNavOptions how = o.gaussians;
  if (o.scene == "default" && !o.solid_alpha_given) how.solid_alpha = 0.2;  // surfaces thin as paper
  auto built = build_navmesh(settings, std::span(&set, 1), beside.vertices, beside.triangles, how);
  if (!built) return {built.code(), o.scene + ": " + built.message()};
  print(o.scene, built->report);
  return std::move(built->mesh);
}

/// The scene with its Gaussians, and with the triangles that a NavMesh may be built of.
Result<OpenedScene> open(const Options& o) {
  OpenOptions how;
  how.up = o.up;
  how.time = o.time;
  how.density = o.density;
  how.navmesh = "none";
  how.keep_triangles = true;
  return gsnav_tools::open_scene(o, how, stdout);
}

/// Checks that the scene has the Gaussians and triangles that the options need.
/// @return ok, or invalid_argument that names the option and the missing part.
Status check_parts(const Options& o, bool gaussians, bool triangles) {
  const auto lacks = [&o](const char* option, const char* what) {
    return Status(Errc::invalid_argument, std::string(option) + ": " + o.scene + " has no " + what);
  };
  if (!triangles && o.navmesh == "mesh") return lacks("--navmesh mesh", "triangles of its own");
  if (gaussians) return {};
  if (o.navmesh == "gaussians") return lacks("--navmesh gaussians", "Gaussians");
  if (!o.visible_sets.empty()) return lacks("--visible-sets", "Gaussians");
  return o.crop.empty() ? Status() : lacks("--crop", "Gaussians");
}

Result<NavMesh> from_scene(const Options& o) {
  const auto scene = open(o);
  if (!scene) return scene.status();
  const std::vector<SceneAsset>& assets = scene->scene->assets;
  const bool own = !scene->triangles->triangles.empty();
  if (Status s = check_parts(o, !assets.empty(), own); !s) return s;
  const bool of_gaussians = o.navmesh == "gaussians" || (o.navmesh == "auto" && !own);
  const auto placed = placement(o, scene->up == "keep" ? "y" : scene->up);
  if (!placed) return placed.status();
  NavMeshTriangles all;
  if (!of_gaussians || o.scene != "default") {  // the flat's triangles are the same surfaces
    Similarity enlarged;
    enlarged.scale = o.scale;
    const NavMeshPart part{scene->triangles->vertices, scene->triangles->triangles, enlarged};
    auto scaled = gather_parts({}, std::span(&part, 1));
    if (!scaled) return scaled.status();
    all = std::move(*scaled);
  }
  for (const std::string& file : o.meshes) {
    if (Status s = add_triangles(file, *placed, all); !s) return s;
  }
  if (Status s = add_objects(o, all); !s) return s;
  auto mesh = of_gaussians ? from_gaussians(o, assets[0].cloud->set(*placed), all) : build(o, all);
  if (!mesh || o.visible_sets.empty()) return mesh;
  if (Status s = write_visible_sets(o, *assets[0].cloud, *mesh, *placed); !s) return s;
  return mesh;
}

Result<NavMesh> make(const Options& o) {
  switch (kind_of(o.scene)) {
    case InputKind::navmesh:
      return load_navmesh(o.scene);
    case InputKind::triangles:
      return from_triangles(o);
    default:
      return from_scene(o);
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
    std::printf("smaller islands: %zu more\n", mesh.island_count() - kShown);
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
