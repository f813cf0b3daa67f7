// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <system_error>

#include "../common/check_values.hpp"
#include "../common/parse_options.hpp"
#include "../common/progress.hpp"
#include "../common/voxel_options.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io.hpp"

namespace gsnav_navmesh {
namespace {

const char kDescription[] =
    "Builds, inspects, converts and draws NavMeshes.\nA SCENE that ends in .navmesh or .bin is read as "
    "a NavMesh (MSET files of Habitat and RecastDemo).\nFrom any other scene a NavMesh is built. Prints "
    "islands and storeys. --out, --obj and --png write files.\nLengths are metres, Y points up.\nExit "
    "status: 0 success; 1 failure, with a message on one line; 2 invalid options.\nExample: "
    "gsnav-navmesh apartment.ply --agent-radius 0.2 --out apartment.navmesh --png map.png";

/// Parses FILE[@X,Y,Z[,YAW[,SCALE]]]. Empty if the text after @ is something else.
std::optional<StaticObject> parse_object(const std::string& text) {
  StaticObject out;
  const std::size_t at = text.rfind('@');
  out.file = text.substr(0, at);
  if (at == std::string::npos) return out;
  std::vector<double> numbers;
  std::istringstream rest(text.substr(at + 1));
  for (std::string word; std::getline(rest, word, ',');) {
    const char* const end = word.data() + word.size();
    const auto [read, error] = std::from_chars(word.data(), end, numbers.emplace_back());
    if (error != std::errc() || read != end || !std::isfinite(numbers.back())) return std::nullopt;
  }
  if (text.back() == ',' || out.file.empty() || numbers.size() < 3 || numbers.size() > 5)
    return std::nullopt;
  out.placed.translation = {numbers[0], numbers[1], numbers[2]};
  const double half = numbers.size() > 3 ? numbers[3] * 0.5 * 3.14159265358979323846 / 180 : 0.0;
  out.placed.rotation = {std::cos(half), 0, std::sin(half), 0};
  if (numbers.size() > 4) out.placed.scale = numbers[4];
  if (!(out.placed.scale > 0)) return std::nullopt;
  return out;
}

/// Options that are checked when all are known.
struct Given {
  CLI::Option *scale = nullptr, *settings = nullptr, *object = nullptr, *cell_height = nullptr,
              *tile_size = nullptr, *solid_alpha = nullptr;
  std::vector<std::string> objects;
};

void add_input(CLI::App& app, Options& o, Given& given) {
  gsnav_tools::add_scene_file_options(app, o);
  app.add_option(
         "--navmesh", o.navmesh,
         "what to build from: gaussians, with the triangles of --mesh; mesh, the triangles of the "
         "scene; auto: mesh if the scene has triangles of its own (default, stages of Habitat)")
      ->check(CLI::IsMember({"auto", "gaussians", "mesh"}))
      ->capture_default_str()
      ->group("Scene");
  gsnav_tools::add_scene_mesh_option(app, o);
  given.scale = app.add_option("--scale", o.scale, "metres per unit of the input; not for a NavMesh")
                    ->check(CLI::PositiveNumber)
                    ->capture_default_str()
                    ->group("Scene");
}

void add_outputs(CLI::App& app, Options& o) {
  const char* write = "Write";
  auto* out = app.add_option("--out", o.out,
                             "NavMesh file to write (.navmesh or .bin; MSET, which Habitat reads)")
                  ->group(write);
  app.add_option("--mset-version", o.mset_version,
                 "version of the file of --out: 2, or 1, which holds no settings")
      ->check(CLI::IsMember({1, 2}))
      ->needs(out)
      ->capture_default_str()
      ->group(write);
  const auto output = [&](const char* name, std::string& file, const char* text, const char* extension) {
    gsnav_tools::check_output_name(app.add_option(name, file, text)->group(write),
                                   gsnav_tools::ends_in({extension}));
  };
  gsnav_tools::check_output_name(out, gsnav_tools::ends_in({".navmesh", ".bin"}));
  output("--settings-out", o.settings_out, "settings file to write (.json, which Habitat reads)",
         ".json");
  output("--obj", o.obj, "file for the surface as triangles, one group per island (.obj)", ".obj");
  output("--png", o.png, "image of the surface from above, one colour per island (.png)", ".png");
  auto* height =
      app.add_option("--height", o.height, "draw the surface near this height, metres")->group(write);
  app.add_option("--level", o.level,
                 "draw this storey, 0 is the lowest; default: the storey with the largest surface")
      ->excludes(height)
      ->check(CLI::NonNegativeNumber)
      ->group(write);
  app.add_option("--metres-per-pixel", o.metres_per_pixel,
                 "scale of the image; 0 makes its longer side 1200 pixels")
      ->check(CLI::NonNegativeNumber)
      ->group(write);
}

void add_build(CLI::App& app, Options& o, Given& given) {
  gsnav::NavMeshSettings& s = o.settings;
  const char* build = "Build (names and defaults as in Habitat)";
  given.settings = app.add_option_function<std::string>(
                          "--settings",
                          [&s](const std::string& file) {
                            const auto read = gsnav::io::load_navmesh_settings(file);
                            if (!read) throw CLI::ValidationError("--settings", read.message());
                            s = *read;
                          },
                          "settings file of Habitat (.json); options after it override it")
                       ->trigger_on_parse()
                       ->group(build);
  given.object = app.add_option("--object", given.objects,
                                "triangles of a static object, placed at X Y Z metres (world frame), "
                                "turned by YAW degrees about Y and scaled by SCALE; may be repeated")
                     ->type_name("FILE[@X,Y,Z[,YAW[,SCALE]]]")
                     ->group(build);
  const auto number = [&](const char* name, double& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(build);
  };
  gsnav_tools::add_voxel_options(app, s.cell_size, o.crop, build);
  given.cell_height =
      app.add_option("--cell-height", s.cell_height, "height of a voxel; 0.05 for Gaussians")
          ->capture_default_str()
          ->group(build);
  number("--agent-height", s.agent_height,
         "height of the agent: free space that it needs above the floor");
  number("--agent-radius", s.agent_radius, "radius of the agent: the surface ends this far from walls");
  number("--agent-max-climb", s.agent_max_climb, "highest step that the agent climbs");
  number("--agent-max-slope", s.agent_max_slope,
         "steepest triangle that the agent can walk on, degrees");
  number("--region-min-size", s.region_min_size,
         "drop regions with fewer cells than the square of this");
  number("--region-merge-size", s.region_merge_size,
         "merge regions with fewer cells than the square of this");
  number("--edge-max-len", s.edge_max_len, "longest edge of the boundary");
  number("--edge-max-error", s.edge_max_error,
         "largest distance of the boundary from the cells, in cells");
  app.add_option("--verts-per-poly", s.verts_per_poly, "largest number of vertices of a polygon, 3 to 6")
      ->capture_default_str()
      ->group(build);
  number("--detail-sample-dist", s.detail_sample_dist,
         "distance between height samples, in cells; below 0.9 takes none");
  number("--detail-sample-max-error", s.detail_sample_max_error,
         "largest height error of the surface, in cell heights");
  given.tile_size =
      app.add_option("--tile-size", s.tile_size,
                     "build in tiles with this many cells per side, in parallel; 0 builds one tile, as "
                     "Habitat does (Gaussians with more than 2^22 columns: 512)")
          ->capture_default_str()
          ->group(build);
  app.add_option("--threads", o.threads, "number of threads; 0 uses all cores")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(build);
  const auto without = [&](const char* name, bool& filter, const char* text) {
    app.add_flag_callback(
           name, [&filter] { filter = false; }, text)
        ->group(build);
  };
  without("--no-filter-low-hanging-obstacles", s.filter_low_hanging_obstacles,
          "do not step over low obstacles");
  without("--no-filter-ledge-spans", s.filter_ledge_spans, "keep the edges of drops walkable");
  without("--no-filter-walkable-low-height-spans", s.filter_walkable_low_height_spans,
          "keep low rooms walkable");
}

void add_gaussians(CLI::App& app, Options& o, Given& given) {
  gsnav::GaussianNavOptions& g = o.gaussians;
  const char* from = "Build from Gaussians";
  const auto option = [&](const char* name, auto& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(from);
  };
  option("--min-opacity", g.min_opacity, "ignore Gaussians with a lower opacity");
  option("--sigmas", g.sigmas, "size of a solid Gaussian, in standard deviations");
  given.solid_alpha = app.add_option("--solid-alpha", g.solid_alpha,
                                     "share of light that a voxel must block to be solid; 0.2 for the "
                                     "embedded flat")
                          ->capture_default_str()
                          ->group(from);
  option("--min-support", g.min_support, "drop groups of fewer connected solid voxels (floaters)");
  option("--max-hole", g.max_hole, "close gaps in the floor up to this width");
  option("--floor-band", g.floor_band, "largest distance of the surface from the height of the floor");
  option("--min-island-area", g.min_island_area, "drop smaller pieces of floor, square metres");
  app.add_flag_callback(
         "--keep-uncovered", [&g] { g.drop_uncovered = false; },
         "keep floors and storeys that have no ceiling above them")
      ->group(from);
  app.add_flag_callback(
         "--keep-underside", [&g] { g.refuse_underside = false; },
         "accept open ground as floor even if nearly everything hangs below it")
      ->group(from);
}

void add_visible_sets(CLI::App& app, Options& o) {
  gsnav::VisibleSettings& v = o.visible;
  const char* seen = "Visible sets of Gaussians";
  app.add_option("--visible-sets", o.visible_sets,
                 "file to write: the Gaussians that are seen from each cell of the NavMesh that cameras "
                 "can be in; gsnav-render --visible-sets reads it")
      ->group(seen);
  app.add_option("--eye-heights", o.eye_heights, "heights of the cameras above the floor, metres")
      ->capture_default_str()
      ->group(seen);
  const auto setting = [&](const char* name, auto& value, const char* text) {
    app.add_option(name, value, text)->capture_default_str()->group(seen);
  };
  gsnav_tools::add_device_option(app, o.device, nullptr, "device that finds visible sets");
  app.get_option("--device")->group(seen);
  setting("--visible-cell", v.cell, "side of a cell, metres; viewpoints are half a side apart");
  setting("--visible-weight", v.min_weight,
          "least share of a pixel that a Gaussian must have to count as seen");
  setting("--visible-rows", v.rows,
          "number of neighbouring Gaussians that are kept or left out together, 1 to 32; 0 takes chunks "
          "of 256");
  setting("--visible-face", v.face,
          "pixels per 90 degrees that the sets are made for; cameras need this focal length or a "
          "shorter one");
  setting(
      "--visible-most", v.most_share,
      "write no file if sampled cells see a larger share of the scene than this; 1 always writes it");
  setting("--near-plane", v.near_plane, "largest near plane of the cameras, metres");
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

/// Rejects options that cannot be combined.
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
  const auto valid = [](const gsnav::Status& s) {
    if (!s) throw CLI::ValidationError(s.message());
  };
  if (kind != InputKind::navmesh) valid(o.settings.validate());
  valid(validate(o.gaussians));
  valid(validate(o.visible));
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
  const char* no_image = "gsnav-navmesh draws no images";
  const char* no_people = "a NavMesh has no people: gsnav-eval and gsnav-viewer add them";
  gsnav_tools::refuse_scene_options(
      app, {{"--storage", "a NavMesh is built from Gaussians as they are in the file"},
            {"--profile", no_image},
            {"--lod-error", no_image},
            {"--lod-levels", "a NavMesh is built from the finest level"},
            {"--avatars", no_people},
            {"--seed", no_people}});
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
