// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>

#include "../common/parse_options.hpp"
#include "../common/progress.hpp"
#include "../common/voxel_options.hpp"
#include "gsnav/core/lower_case.hpp"
#include "gsnav/io.hpp"

namespace gsnav_navmesh {
namespace {

const char kDescription[] =
    "Builds, inspects, converts and draws NavMeshes. SCENE is read as a NavMesh where it ends in "
    ".navmesh or .bin (Habitat's and RecastDemo's MSET files); else one is built of the scene. What it "
    "is made of is printed; --out, --obj and --png write it. Lengths in metres, Y up. Exit status: 0; 1 "
    "with one line that says what is wrong; 2 where the command line cannot be.";

/// FILE[@X,Y,Z[,YAW[,SCALE]]]; none where what follows the @ is something else.
std::optional<StaticObject> parse_object(const std::string& text) {
  StaticObject out;
  const std::size_t at = text.rfind('@');
  out.file = text.substr(0, at);
  if (at == std::string::npos) return out;
  std::vector<double> numbers;
  std::istringstream rest(text.substr(at + 1));
  for (std::string word; std::getline(rest, word, ',');) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (word.empty() || *end != 0 || !std::isfinite(numbers.back())) return std::nullopt;
  }
  if (out.file.empty() || numbers.size() < 3 || numbers.size() > 5) return std::nullopt;
  out.placed.translation = {numbers[0], numbers[1], numbers[2]};
  const double half = numbers.size() > 3 ? numbers[3] * 0.5 * 3.14159265358979323846 / 180 : 0.0;
  out.placed.rotation = {std::cos(half), 0, std::sin(half), 0};
  if (numbers.size() > 4) out.placed.scale = numbers[4];
  if (!(out.placed.scale > 0)) return std::nullopt;
  return out;
}

/// Options that are looked at again when all are known.
struct Given {
  CLI::Option *scale = nullptr, *settings = nullptr, *object = nullptr, *cell_height = nullptr,
              *tile_size = nullptr, *solid_alpha = nullptr;
  std::vector<std::string> objects;
};

void add_input(CLI::App& app, Options& o, Given& given) {
  gsnav_tools::add_scene_file_options(app, o);
  app.get_option("--scene")->required();
  app.add_option("--navmesh", o.navmesh,
                 "what it is built of: gaussians, and the triangles of --mesh; mesh, the scene's "
                 "triangles; auto: mesh where the scene has any of its own (default, Habitat's stages)")
      ->check(CLI::IsMember({"auto", "gaussians", "mesh"}))
      ->capture_default_str()
      ->group("Scene");
  gsnav_tools::add_scene_mesh_option(app, o);
  given.scale = app.add_option("--scale", o.scale, "metres a unit of the scene's file")
                    ->check(CLI::PositiveNumber)
                    ->capture_default_str()
                    ->group("Scene");
}

void add_outputs(CLI::App& app, Options& o) {
  const char* write = "Write";
  auto* out = app.add_option("--out", o.out, "NavMesh file (MSET, as Habitat reads it)")->group(write);
  app.add_option("--mset-version", o.mset_version, "Of --out: 2, or 1, which has no settings")
      ->check(CLI::IsMember({1, 2}))
      ->needs(out)
      ->capture_default_str()
      ->group(write);
  app.add_option("--settings-out", o.settings_out, "Its settings (.json), as Habitat reads them")
      ->group(write);
  app.add_option("--obj", o.obj, "The surface as triangles, one group an island")->group(write);
  app.add_option("--png", o.png, "The surface from above, islands by colour")->group(write);
  auto* height =
      app.add_option("--height", o.height, "Draw what is walkable near this height")->group(write);
  app.add_option("--level", o.level,
                 "Draw this storey, 0 is the lowest; the one with the most surface by default")
      ->excludes(height)
      ->group(write);
  app.add_option("--metres-per-pixel", o.metres_per_pixel,
                 "Of the picture; 0: 1200 pixels for the longer side")
      ->check(CLI::NonNegativeNumber)
      ->group(write);
}

void add_build(CLI::App& app, Options& o, Given& given) {
  gsnav::NavMeshSettings& s = o.settings;
  const char* build = "Build (names and defaults are Habitat's)";
  given.settings = app.add_option_function<std::string>(
                          "--settings",
                          [&s](const std::string& file) {
                            const auto read = gsnav::io::load_navmesh_settings(file);
                            if (!read) throw CLI::ValidationError("--settings", read.message());
                            s = *read;
                          },
                          "Settings (.json) as Habitat writes them; options beside it come after it")
                       ->trigger_on_parse()
                       ->group(build);
  given.object =
      app.add_option(
             "--object", given.objects,
             "Triangles of an object that stands in the scene for good, at X Y Z metres of the world, "
             "turned by YAW degrees about Y and enlarged by SCALE; for each object once more")
          ->type_name("FILE[@X,Y,Z[,YAW[,SCALE]]]")
          ->group(build);
  const auto number = [&](const char* name, double& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(build);
  };
  gsnav_tools::add_voxel_options(app, s.cell_size, o.crop, build);
  given.cell_height = app.add_option("--cell-height", s.cell_height, "Voxel height; 0.05 for Gaussians")
                          ->capture_default_str()
                          ->group(build);
  number("--agent-height", s.agent_height, "Clearance that the agent needs");
  number("--agent-radius", s.agent_radius, "The surface ends this far from walls");
  number("--agent-max-climb", s.agent_max_climb, "Highest step");
  number("--agent-max-slope", s.agent_max_slope, "Steepest walkable triangle, degrees");
  number("--region-min-size", s.region_min_size, "Regions below this many cells squared are dropped");
  number("--region-merge-size", s.region_merge_size, "Regions below this many cells squared are merged");
  number("--edge-max-len", s.edge_max_len, "Longest boundary edge");
  number("--edge-max-error", s.edge_max_error, "How far a boundary may leave the cells, in cells");
  app.add_option("--verts-per-poly", s.verts_per_poly, "3 to 6")->capture_default_str()->group(build);
  number("--detail-sample-dist", s.detail_sample_dist,
         "Spacing of height samples, in cells; below 0.9: none");
  number("--detail-sample-max-error", s.detail_sample_max_error,
         "Height error of the surface, in cell heights");
  given.tile_size = app.add_option("--tile-size", s.tile_size,
                                   "Build in tiles of so many cells a side, in parallel; 0: one tile, "
                                   "as Habitat does (Gaussians "
                                   "over 2^22 columns: 512)")
                        ->capture_default_str()
                        ->group(build);
  app.add_option("--threads", o.threads, "That share out the tiles; 0: one a core")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(build);
  const auto without = [&](const char* name, bool& filter, const char* text) {
    app.add_flag_callback(
           name, [&filter] { filter = false; }, text)
        ->group(build);
  };
  without("--no-filter-low-hanging-obstacles", s.filter_low_hanging_obstacles,
          "Low obstacles are not stepped over");
  without("--no-filter-ledge-spans", s.filter_ledge_spans, "Edges of drops stay walkable");
  without("--no-filter-walkable-low-height-spans", s.filter_walkable_low_height_spans,
          "Low rooms stay walkable");
}

void add_gaussians(CLI::App& app, Options& o, Given& given) {
  gsnav::GaussianNavOptions& g = o.gaussians;
  const char* from = "Build from Gaussians";
  const auto option = [&](const char* name, auto& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(from);
  };
  option("--min-opacity", g.min_opacity, "Fainter Gaussians are ignored");
  option("--sigmas", g.sigmas, "How far out a Gaussian is solid, in standard deviations");
  given.solid_alpha =
      app.add_option("--solid-alpha", g.solid_alpha,
                     "Share of light that a solid voxel blocks; 0.2 of the embedded flat")
          ->capture_default_str()
          ->group(from);
  option("--min-support", g.min_support, "Connected solid voxels below this count are floaters");
  option("--max-hole", g.max_hole, "Gaps in the floor up to this wide are closed");
  option("--floor-band", g.floor_band, "The surface stays within this of the floor's height");
  option("--min-island-area", g.min_island_area, "Smaller pieces of floor are dropped, square metres");
  app.add_flag_callback(
         "--keep-uncovered", [&g] { g.drop_uncovered = false; },
         "Keep floor and storeys that have no ceiling above them")
      ->group(from);
  app.add_flag_callback(
         "--keep-underside", [&g] { g.refuse_underside = false; },
         "Take open ground for the floor even where nearly everything hangs below it")
      ->group(from);
}

void add_visible_sets(CLI::App& app, Options& o) {
  gsnav::VisibleSettings& v = o.visible;
  const char* seen = "Visible sets of Gaussians";
  app.add_option("--visible-sets", o.visible_sets,
                 "File to write: what is seen from each cell of the NavMesh "
                 "that eyes can be in (gsnav-render reads it)")
      ->group(seen);
  app.add_option("--eye-heights", o.eye_heights, "Of cameras, metres above the floor")
      ->capture_default_str()
      ->group(seen);
  const auto setting = [&](const char* name, auto& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(seen);
  };
  setting("--visible-cell", v.cell,
          "Side of a cell, metres; places that are looked from are half of it apart");
  setting("--visible-weight", v.min_weight,
          "Gaussians are seen where one that lies with them has more of a pixel than this");
  setting("--visible-rows", v.rows,
          "How many neighbouring Gaussians are seen or not together, up to 32; 0: a whole chunk of 256");
  setting("--visible-face", v.face,
          "Pixels that span 90 degrees: for cameras of no larger focal length");
  setting(
      "--visible-most", v.most_share,
      "Write no file where cells of a sample see more than this share: nothing is gained (1: write it)");
  setting("--near-plane", v.near_plane, "Of cameras, at most; metres");
}

}  // namespace

InputKind kind_of(const std::string& scene) {
  const std::string extension = gsnav::lower_case(std::filesystem::path(scene).extension().string());
  if (extension == ".navmesh" || extension == ".bin") return InputKind::navmesh;
  if (extension == ".obj") return InputKind::triangles;
  const bool gltf = extension == ".glb" || extension == ".gltf";
  return gltf && !gsnav::io::gltf_holds_gaussians(scene) ? InputKind::triangles : InputKind::scene;
}

namespace {

/// Refuses options that do not go together.
void check_together(const CLI::App& app, Options& o, const Given& given) {
  const auto is_given = [&app](const char* name) { return app.get_option(name)->count() > 0; };
  const auto refuse = [&is_given](std::initializer_list<const char*> names, const std::string& why) {
    for (const char* name : names)
      if (is_given(name)) throw CLI::ValidationError(name, why);
  };
  const InputKind kind = kind_of(o.scene);
  if (o.scale != 1) refuse({"--visible-sets"}, "not with --scale: gsnav-render knows no scale");
  if (kind == InputKind::navmesh) {
    refuse(
        {"--up", "--scale", "--time", "--density", "--navmesh", "--tile-size", "--object", "--settings"},
        o.scene + " is a NavMesh: it stands as it is");
  }
  if (kind != InputKind::scene)
    refuse({"--visible-sets", "--crop", "--mesh"}, o.scene + " has no Gaussians");
  if (kind == InputKind::triangles && o.navmesh == "gaussians")
    throw CLI::ValidationError("--navmesh", o.scene + " has no Gaussians");
  for (const std::string& text : given.objects) {
    const auto one = parse_object(text);
    if (!one) throw CLI::ValidationError("--object", text + " is not FILE[@X,Y,Z[,YAW[,SCALE]]]");
    o.objects.push_back(*one);
    o.settings.include_static_objects = true;
  }
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, int& exit_code) {
  Options o;
  CLI::App app{kDescription};
  Given given;
  add_input(app, o, given);
  add_outputs(app, o);
  add_build(app, o, given);
  add_gaussians(app, o, given);
  add_visible_sets(app, o);
  const auto status =
      gsnav_tools::parse_options(app, argc, argv, [&] { check_together(app, o, given); });
  if (status) {
    exit_code = *status;
    return std::nullopt;
  }
  o.cell_height_given = given.cell_height->count() + given.settings->count() > 0;
  o.solid_alpha_given = given.solid_alpha->count() > 0;
  if (!o.crop.empty()) o.gaussians.crop = gsnav_tools::box_of(o.crop);
  o.gaussians.progress = [print = gsnav_tools::progress_printer()](const char* stage, double share) {
    print(std::string("NavMesh: ") + stage, share);
  };
  o.gaussians.threads = o.threads;
  return o;
}

}  // namespace gsnav_navmesh
