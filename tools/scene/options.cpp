// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "../common/check_values.hpp"
#include "../common/parse_options.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/io/scene_file.hpp"

namespace gsnav_scene {
namespace {

const char kDescription[] =
    "Makes scenes and people from code, for benchmarks, examples and tests.\nLengths are metres, Y "
    "points up, floors are at y = 0. The same options give the same files.\nExit status: 0 success; 1 "
    "failure, with a message on one line; 2 invalid options.\nExample: gsnav-scene default --out flat";

constexpr std::size_t kLeastGaussians = 10'000;

using gsnav::io::check_scene_output;
using gsnav_tools::check_output_name;
using gsnav_tools::ends_in;

void add_outputs(CLI::App& app, SceneCommand& c) {
  check_output_name(app.add_option("--mesh", c.out.mesh, "file for the surfaces as triangles (.obj)"),
                    ends_in({".obj"}));
  check_output_name(
      app.add_option("--cameras", c.out.cameras, "file for views inside the rooms (INRIA cameras.json)"),
      ends_in({".json"}));
  app.add_option("--views", c.views.count, "number of views")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--width", c.views.width, "width of a view, pixels")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  app.add_option("--height", c.views.height, "height of a view, pixels")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  app.add_option("--hfov", c.views.hfov, "horizontal field of view, degrees")
      ->check(CLI::Range(10.0, 150.0))
      ->capture_default_str();
}

void add_scene_file(CLI::App& app, SceneCommand& c) {
  CLI::Option* out =
      app.add_option("--out", c.out.scene,
                     "scene file to write: .ply, .compressed.ply, .splat, .spz, .sog or .glb")
          ->required();
  check_output_name(out, check_scene_output);
}

CLI::Option* add_gaussians(CLI::App& app, SceneCommand& c, const char* what) {
  c.sampling.sh_degree = gsnav::kMaxShDegree;
  app.add_option("--sh-degree", c.sampling.sh_degree,
                 "degree of the colours: 0, the same from everywhere, or up to 3, with a sheen of "
                 "windows and lamps")
      ->check(CLI::Range(0, gsnav::kMaxShDegree))
      ->capture_default_str();
  return app.add_option("--gaussians", c.sampling.gaussians, what)
      ->check(CLI::Range(kLeastGaussians, gsnav::kMostSceneGaussians));
}

CLI::App* add_flat(CLI::App& app, SceneCommand& c) {
  CLI::App* flat = app.add_subcommand(
      "flat", "the benchmark flat: four furnished rooms with any number of Gaussians");
  c.sampling.gaussians = 1'000'000;
  add_scene_file(*flat, c);
  add_gaussians(*flat, c, "exact number of Gaussians")->capture_default_str();
  add_outputs(*flat, c);
  flat->add_option("--seed", c.views.seed, "seed of the views")->capture_default_str();
  return flat;
}

CLI::App* add_rooms(CLI::App& app, SceneCommand& c) {
  CLI::App* rooms = app.add_subcommand(
      "rooms", "a different flat for each seed: rooms, doors, windows, furniture and colours vary");
  c.rooms = true;
  add_scene_file(*rooms, c);
  rooms->add_option("--seed", c.plan.seed, "seed of the flat and the views")->capture_default_str();
  rooms->add_option("--rooms", c.plan.rooms, "number of rooms")
      ->check(CLI::Range(1, gsnav::kMostRooms))
      ->capture_default_str();
  rooms
      ->add_option("--clearance", c.plan.clearance,
                   "radius of a disc that can reach all floor between the furniture, metres")
      ->check(CLI::Range(0.1, 0.35))
      ->capture_default_str();
  CLI::Option* count =
      add_gaussians(*rooms, c, "exact number of Gaussians; without it, --density decides");
  rooms
      ->add_option("--density", c.sampling.density,
                   "density of the Gaussians; 1 gives about 100,000 per room")
      ->check(CLI::Range(0.05, 20.0))
      ->excludes(count)
      ->capture_default_str();
  add_outputs(*rooms, c);
  return rooms;
}

/// Whether `default --out` is a folder.
bool names_folder(const std::filesystem::path& path) {
  std::error_code ignored;
  return !path.has_extension() || std::filesystem::is_directory(path, ignored);
}

CLI::App* add_default(CLI::App& app, SceneCommand& c) {
  CLI::App* flat =
      app.add_subcommand("default", "the embedded flat, which programs open as --scene default");
  CLI::Option* out =
      flat->add_option("--out", c.out.scene,
                       "folder for flat.ply, flat.obj and cameras.json, made if it does not exist; or a "
                       "scene file, by its extension")
          ->required();
  check_output_name(out, [](const std::string& path) {
    return names_folder(path) ? gsnav::Status() : check_scene_output(path);
  });
  add_outputs(*flat, c);
  return flat;
}

CLI::App* add_humanoid(CLI::App& app, HumanoidCommand& c) {
  CLI::App* person =
      app.add_subcommand("humanoid", "a person: Gaussians, skeleton, skinning weights and capsules");
  CLI::Option* out =
      person
          ->add_option("--out", c.out,
                       "avatar file to write (.npz with the keys of Habitat-GS); the extension of a "
                       "scene file writes the Gaussians of the standing person only")
          ->required();
  check_output_name(out, [](const std::string& path) {
    return gsnav::lower_case(path).ends_with(".npz") ? gsnav::Status() : check_scene_output(path);
  });
  person
      ->add_option("--seed", c.seed,
                   "seed of height, build, hair and clothes; 0 is the person of the demo")
      ->capture_default_str();
  person->add_option("--gaussians", c.gaussians, "approximate number of Gaussians")
      ->check(CLI::Range(2000, 400000))
      ->capture_default_str();
  return person;
}

/// Sets the names of the files in the folder of `default --out`, if it is used.
void name_files_in_folder(Outputs& out) {
  const std::filesystem::path path(out.scene);
  if (!names_folder(path)) return;
  out.folder = path.string();
  out.scene = (path / "flat.ply").string();
  if (out.mesh.empty()) out.mesh = (path / "flat.obj").string();
  if (out.cameras.empty()) out.cameras = (path / "cameras.json").string();
}

/// Throws CLI::ValidationError if two outputs are one file.
void check_different(const Outputs& out) {
  const auto same = [](const std::string& a, const std::string& b) { return !a.empty() && a == b; };
  if (same(out.scene, out.cameras) || same(out.mesh, out.cameras) || same(out.scene, out.mesh))
    throw CLI::ValidationError("--out, --mesh and --cameras", "must name different files");
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, int& exit_code) {
  Options out;
  SceneCommand flat, rooms, embedded;
  HumanoidCommand humanoid;
  CLI::App app{kDescription};
  app.require_subcommand(1);
  const CLI::App* flat_command = add_flat(app, flat);
  const CLI::App* rooms_command = add_rooms(app, rooms);
  const CLI::App* default_command = add_default(app, embedded);
  add_humanoid(app, humanoid);
  const auto check = [&] {
    if (default_command->parsed()) name_files_in_folder(embedded.out);
    for (const SceneCommand* c : {&flat, &rooms, &embedded}) check_different(c->out);
  };
  if (const auto status = gsnav_tools::parse_options(app, argc, argv, check)) {
    exit_code = *status;
    return {};
  }
  if (flat_command->parsed()) {
    out.scene = flat;
  } else if (rooms_command->parsed()) {
    out.scene = rooms;
    out.scene->views.seed = rooms.plan.seed;
  } else if (default_command->parsed()) {
    out.scene = embedded;
  } else {
    out.humanoid = humanoid;
  }
  return out;
}

}  // namespace gsnav_scene
