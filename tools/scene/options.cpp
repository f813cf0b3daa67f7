// SPDX-License-Identifier: Apache-2.0
#include "options.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>

#include "../common/parse_options.hpp"

namespace gsnav_scene {
namespace {

const char kDescription[] =
    "Makes scenes and people by code alone, to run benchmarks, examples and tests on. Lengths in "
    "metres, "
    "Y up, floors at y = 0. The same options give the same files. Exit status: 0, 1 with one line that "
    "says what is wrong, 2 for options that cannot be used.";

constexpr std::size_t kLeastGaussians = 10'000;

void add_outputs(CLI::App& app, SceneCommand& c) {
  app.add_option("--mesh", c.out.mesh, "Its surfaces as triangles to write (.obj)");
  app.add_option("--cameras", c.out.cameras, "Views inside the rooms to write (INRIA cameras.json)");
  app.add_option("--views", c.views.count, "Number of views")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--width", c.views.width, "Of a view, pixels")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  app.add_option("--height", c.views.height, "Of a view, pixels")
      ->check(CLI::Range(1, 16384))
      ->capture_default_str();
  app.add_option("--hfov", c.views.hfov, "Horizontal field of view, degrees")
      ->check(CLI::Range(10.0, 150.0))
      ->capture_default_str();
}

void add_scene_file(CLI::App& app, SceneCommand& c) {
  app.add_option("--out", c.out.scene,
                 "Scene to write: .ply, .compressed.ply, .splat, .spz, .sog or .glb")
      ->required();
}

CLI::Option* add_gaussians(CLI::App& app, SceneCommand& c, const char* what) {
  c.sampling.sh_degree = gsnav::kMaxShDegree;
  app.add_option(
         "--sh-degree", c.sampling.sh_degree,
         "Of colours: 0, the same from everywhere, or up to 3, with a sheen of windows and lamps")
      ->check(CLI::Range(0, gsnav::kMaxShDegree))
      ->capture_default_str();
  return app.add_option("--gaussians", c.sampling.gaussians, what)
      ->check(CLI::Range(kLeastGaussians, gsnav::kMostSceneGaussians));
}

CLI::App* add_flat(CLI::App& app, SceneCommand& c) {
  CLI::App* flat =
      app.add_subcommand("flat", "The benchmark flat: four furnished rooms, in any number of Gaussians");
  c.sampling.gaussians = 1'000'000;
  add_scene_file(*flat, c);
  add_gaussians(*flat, c, "Exactly so many")->capture_default_str();
  add_outputs(*flat, c);
  flat->add_option("--seed", c.views.seed, "Of the views")->capture_default_str();
  return flat;
}

CLI::App* add_rooms(CLI::App& app, SceneCommand& c) {
  CLI::App* rooms = app.add_subcommand(
      "rooms", "A flat of its own for each seed: rooms, doors, windows, furniture and colours vary");
  c.rooms = true;
  add_scene_file(*rooms, c);
  rooms->add_option("--seed", c.plan.seed, "Of all that varies")->capture_default_str();
  rooms->add_option("--rooms", c.plan.rooms, "Number of rooms")
      ->check(CLI::Range(1, gsnav::kMostRooms))
      ->capture_default_str();
  rooms
      ->add_option("--clearance", c.plan.clearance,
                   "Radius of a disc that reaches all of the floor between the furniture")
      ->check(CLI::Range(0.1, 0.35))
      ->capture_default_str();
  CLI::Option* count = add_gaussians(*rooms, c, "Exactly so many; without it --density says it");
  rooms->add_option("--density", c.sampling.density, "Of Gaussians: 1 gives about 100,000 a room")
      ->check(CLI::Range(0.05, 20.0))
      ->excludes(count)
      ->capture_default_str();
  add_outputs(*rooms, c);
  return rooms;
}

CLI::App* add_default(CLI::App& app, SceneCommand& c) {
  CLI::App* flat = app.add_subcommand(
      "default", "The flat that is used where no scene is given, as it is embedded in the library");
  flat->add_option(
          "--out", c.out.scene,
          "Folder for flat.ply, flat.obj and cameras.json, made where it does not exist; or the "
          "scene alone, by its extension")
      ->required();
  add_outputs(*flat, c);
  return flat;
}

CLI::App* add_humanoid(CLI::App& app, HumanoidCommand& c) {
  CLI::App* person = app.add_subcommand(
      "humanoid", "The person of the demo: Gaussians, skeleton, skinning weights and capsules");
  person
      ->add_option("--out", c.out,
                   "Avatar to write (.npz, Habitat-GS's keys); a scene's extension gives its Gaussians "
                   "alone, as it stands")
      ->required();
  person
      ->add_option("--seed", c.seed,
                   "Another height, build, hair and clothes for each; 0: the person of the demo")
      ->capture_default_str();
  person->add_option("--gaussians", c.gaussians, "About so many")
      ->check(CLI::Range(2000, 400000))
      ->capture_default_str();
  return person;
}

/// Names the files in the folder that `default --out` asks for, if it does.
void name_files_in_folder(Outputs& out) {
  const std::filesystem::path path(out.scene);
  std::error_code ignored;
  if (path.has_extension() && !std::filesystem::is_directory(path, ignored)) return;
  out.folder = path.string();
  out.scene = (path / "flat.ply").string();
  if (out.mesh.empty()) out.mesh = (path / "flat.obj").string();
  if (out.cameras.empty()) out.cameras = (path / "cameras.json").string();
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
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) {
    exit_code = *status;
    return {};
  }
  if (flat_command->parsed()) {
    out.scene = flat;
  } else if (rooms_command->parsed()) {
    out.scene = rooms;
    out.scene->views.seed = rooms.plan.seed;
  } else if (default_command->parsed()) {
    name_files_in_folder(embedded.out);
    out.scene = embedded;
  } else {
    out.humanoid = humanoid;
  }
  return out;
}

}  // namespace gsnav_scene
