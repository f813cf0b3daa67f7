// SPDX-License-Identifier: Apache-2.0
#include "scene_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "gsnav/core/text.hpp"
#include "gsnav/scene/prepare.hpp"
#include "progress.hpp"
#include "voxel_options.hpp"

namespace gsnav_tools {
namespace {

constexpr const char* kGroup = "Scene";

void add_density_option(CLI::App& app, SceneOptions& o, const char* what) {
  app.add_option("--density", o.density, what)
      ->capture_default_str()
      ->check(CLI::Range(0.05, 20.0))
      ->group(kGroup);
}

void add_file_options(CLI::App& app, SceneOptions& o) {
  app.add_option("scene,--scene", o.scene,
                 "scene to open: default (the embedded flat); a file of Gaussians (.ply, .sog, .spz, "
                 ".splat, .ksplat, .glb); a folder; tiles (DIR/2_0,2_1); triangles (.glb, .obj); or a "
                 "Habitat scene (SET.scene_dataset_config.json#NAME, NAME.stage_config.json)")
      ->capture_default_str()
      ->type_name("SCENE")
      ->group(kGroup);
  app.add_option("--up", o.up,
                 "axis of the file that points up: x, y, z, -x, -y or -z; auto guesses it from the "
                 "ground; keep leaves the axes of the file")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "keep", "x", "y", "z", "+x", "+y", "+z", "-x", "-y", "-z"}))
      ->type_name("AXIS")
      ->group(kGroup);
  app.add_option("--time", o.time, "time to show of a scene that moves (4D Gaussians), seconds")
      ->capture_default_str()
      ->group(kGroup);
}

void add_storage_option(CLI::App& app, SceneOptions& o) {
  app.add_option("--storage", o.storage,
                 "storage in memory: full (float32), compact (half the memory for SH) or packed (a "
                 "third for everything)")
      ->check(CLI::IsMember({"full", "compact", "packed"}))
      ->capture_default_str()
      ->group(kGroup);
}

void add_drawing_options(CLI::App& app, SceneOptions& o) {
  app.add_option(
         "--profile", o.profile,
         "quality: exact (rounding only), fast (a cheaper exponential; a pixel that lets less than "
         "1/1000 of the light through is made opaque) or lod (a level of detail for each part of the "
         "scene)")
      ->check(CLI::IsMember({"exact", "fast", "lod"}))
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--lod-error", o.lod_error,
                 "with --profile lod: largest error of merged Gaussians, pixels")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--lod-levels", o.lod_levels,
                 "with --profile lod: shipped uses the levels of a streamed set, if it has any; built "
                 "makes them from its finest level and stores them next to the scene file")
      ->check(CLI::IsMember({"shipped", "built"}))
      ->capture_default_str()
      ->group(kGroup);
  app.add_option("--visible-sets", o.visible_sets,
                 "with --profile fast or lod: draw only what the cell of the camera sees; a file from "
                 "gsnav-navmesh, or auto to compute the sets and store them next to the scene file")
      ->type_name("FILE")
      ->group(kGroup);
}

void add_navmesh_options(CLI::App& app, SceneOptions& o) {
  app.add_option("--navmesh", o.navmesh,
                 "NavMesh: a file (.navmesh, .bin); auto (the file next to the scene file, else built); "
                 "gaussians or mesh (built from these); or none")
      ->capture_default_str()
      ->type_name("FILE")
      ->check([](const std::string& v) {
        const std::string name = gsnav::lower_case(v);
        const bool known = v == "auto" || v == "mesh" || v == "gaussians" || v == "none";
        if (known || name.ends_with(".navmesh") || name.ends_with(".bin")) return std::string();
        return v + ": use auto, mesh, gaussians, none, or a file that ends in .navmesh or .bin";
      })
      ->group(kGroup);
  add_voxel_options(app, o.cell_size, o.crop, kGroup);
}

void add_people_options(CLI::App& app, SceneOptions& o) {
  app.add_option("--avatars", o.avatars,
                 "number of people who walk about; 0 takes those of a Habitat data set, if it has any")
      ->capture_default_str()
      ->check(CLI::Range(0, 64))
      ->group(kGroup);
  app.add_option("--seed", o.seed, "seed of people, episodes and random policies")
      ->capture_default_str()
      ->group(kGroup);
}

}  // namespace

void add_view_options(CLI::App& app, ViewOptions& o) {
  app.add_option("--width", o.width, "image width, pixels")
      ->capture_default_str()
      ->check(CLI::Range(16, 4096));
  app.add_option("--height", o.height, "image height, pixels")
      ->capture_default_str()
      ->check(CLI::Range(16, 4096));
  app.add_option("--hfov", o.hfov, "horizontal field of view, degrees")
      ->capture_default_str()
      ->check(CLI::Range(10.0, 170.0));
  app.add_option("--eye-height", o.eye_height, "height of the camera above the floor, metres")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 3.0));
}

void add_scene_file_options(CLI::App& app, SceneOptions& o) {
  add_file_options(app, o);
  add_density_option(app, o, "density of Gaussians in the embedded flat, relative to the default");
}

void add_scene_mesh_option(CLI::App& app, SceneOptions& o) {
  app.add_option("--mesh", o.meshes,
                 "triangle meshes to draw among the Gaussians (.gltf, .glb with colours and textures; "
                 ".obj, .ply in grey), in the axes of the scene file")
      ->type_name("FILE")
      ->group(kGroup);
}

void add_scene_options(CLI::App& app, SceneOptions& o, bool* float64) {
  add_file_options(app, o);
  add_storage_option(app, o);
  add_drawing_options(app, o);
  add_scene_mesh_option(app, o);
  add_navmesh_options(app, o);
  add_people_options(app, o);
  add_density_option(app, o,
                     "density of Gaussians in the embedded flat and in people, relative to the default");
  add_device_option(app, o.device, float64);
  app.final_callback([&o] {
    if (!o.visible_sets.empty() && o.profile == "exact") {
      throw CLI::ValidationError("--visible-sets",
                                 "sampled, so not for --profile exact; use fast or lod");
    }
  });
}

void refuse_scene_options(CLI::App& app, std::initializer_list<UnusedOption> unused) {
  for (const UnusedOption& o : unused) {
    app.add_option_function<std::vector<std::string>>(
           o.name, [o](const std::vector<std::string>&) { throw CLI::ValidationError(o.name, o.why); })
        ->group("");  // not in --help
  }
}

gsnav::OpenOptions open_options(const SceneOptions& o) {
  gsnav::OpenOptions how;
  how.device = o.device;
  how.up = o.up;
  how.time = o.time;
  how.storage = o.storage == "packed"    ? gsnav::CloudStorage::packed
                : o.storage == "compact" ? gsnav::CloudStorage::compact
                                         : gsnav::CloudStorage::full;
  how.unseen_color = o.profile == "exact" ? 0 : gsnav::kUnseenColor;
  how.levels = o.profile != "lod"        ? gsnav::SceneLevels::none
               : o.lod_levels == "built" ? gsnav::SceneLevels::built
                                         : gsnav::SceneLevels::shipped;
  how.visible_sets = o.visible_sets;
  how.meshes = o.meshes;
  how.navmesh = o.navmesh;
  how.cell_size = o.cell_size;
  if (o.crop.size() == 6) how.crop = box_of(o.crop);
  how.people = static_cast<std::size_t>(o.avatars);
  how.seed = o.seed;
  how.density = o.density;
  return how;
}

gsnav::Result<gsnav::OpenedScene> open_scene(const SceneOptions& o, const gsnav::OpenOptions& how,
                                             std::FILE* notes) {
  gsnav::OpenOptions asked = how;
  asked.progress = progress_printer();
  auto scene = gsnav::open_scene(o.scene, asked);
  if (!scene) return scene;
  for (const std::string& note : scene->notes)
    std::fprintf(notes, "%s\n", gsnav::printable(note).c_str());
  std::fflush(notes);
  for (const std::string& warning : scene->warnings)
    std::fprintf(stderr, "warning: %s\n", gsnav::printable(warning).c_str());
  return scene;
}

gsnav::Quality quality_of(const SceneOptions& o) {
  return o.profile == "exact" ? gsnav::Quality::exact() : gsnav::Quality::fast();
}

gsnav::DetailChoice detail_of(const SceneOptions& o, const gsnav::OpenedScene& scene) {
  gsnav::DetailChoice out;
  if (o.profile == "lod") {
    out.lod = gsnav::LodChoice{};
    out.lod->pixels = o.lod_error;
  }
  const auto& assets = scene.scene->assets;
  out.visible_sets = !assets.empty() && assets.front().visible != nullptr;
  return out;
}

}  // namespace gsnav_tools
