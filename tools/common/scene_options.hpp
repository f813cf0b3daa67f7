// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "device_option.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/open.hpp"
#include "gsnav/render.hpp"
#include "gsnav/sim.hpp"

// What scene a program works on: the same options in all of them.

namespace CLI {
class App;
}

namespace gsnav_tools {

struct SceneOptions {
  std::string scene = "default";
  std::string up = "auto";
  double time = 0;
  std::string storage = "full";   ///< full, compact, packed
  std::string profile = "exact";  ///< exact, fast, lod
  double lod_error = gsnav::LodChoice{}.pixels;
  std::string lod_levels = "shipped";  ///< shipped, built
  std::string visible_sets;            ///< auto or a file; empty: none
  std::vector<std::string> meshes;
  std::string navmesh = "auto";  ///< as gsnav::OpenOptions::navmesh
  double cell_size = 0.05;       ///< metres
  std::vector<double> crop;      ///< x0 y0 z0 x1 y1 z1 in the world; empty: all of the scene
  int avatars = 3;
  std::uint64_t seed = 1;
  double density = 1.0;
  gsnav::Device device;
};

/// Adds those that say what the scene is: --scene (or its name alone), --up, --time, --density.
void add_scene_file_options(CLI::App& app, SceneOptions& o);
/// Adds --mesh: triangles beside the Gaussians.
void add_scene_mesh_option(CLI::App& app, SceneOptions& o);
/// Adds all of them; their defaults are `o`'s. `float64` as of add_device_option.
void add_scene_options(CLI::App& app, SceneOptions& o, bool* float64 = nullptr);
/// As the library takes them.
gsnav::OpenOptions open_options(const SceneOptions& o);

/// Opens the scene. What there is to say goes to `notes`; warnings and progress go to stderr. Errors:
/// invalid_argument naming options that do not go together; those of gsnav::open_scene.
gsnav::Result<gsnav::OpenedScene> open_scene(const SceneOptions& o, const gsnav::OpenOptions& how,
                                             std::FILE* notes);

/// How the profile draws.
gsnav::Quality quality_of(const SceneOptions& o);
gsnav::DetailChoice detail_of(const SceneOptions& o, const gsnav::OpenedScene& scene);

}  // namespace gsnav_tools
