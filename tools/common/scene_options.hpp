// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <vector>

#include "device_option.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/open.hpp"
#include "gsnav/render.hpp"
#include "gsnav/sim.hpp"

// Scene options shared by all programs.

namespace CLI {
class App;
}

namespace gsnav_tools {

struct SceneOptions {
  std::string scene = "default";
  std::string up = "auto";
  double time = 0;
  std::string storage = "full";   ///< One of full, compact, packed.
  std::string profile = "exact";  ///< One of exact, fast, lod.
  double lod_error = gsnav::LodChoice{}.pixels;
  std::string lod_levels = "shipped";  ///< One of shipped, built.
  std::string visible_sets;            ///< "auto" or a file. Empty: none.
  std::vector<std::string> meshes;
  std::string navmesh = "auto";  ///< See gsnav::OpenOptions::navmesh.
  double cell_size = 0.05;       ///< Metres.
  std::vector<double> crop;      ///< World box as x0 y0 z0 x1 y1 z1. Empty: the whole scene.
  int avatars = 3;
  std::uint64_t seed = 1;
  double density = 1.0;
  gsnav::Device device;
};

/// The camera of an agent.
struct ViewOptions {
  int width = 256, height = 256;  ///< Pixels.
  double hfov = 90.0;             ///< Degrees.
  double eye_height = 1.5;        ///< Metres above the floor.
};

/// Adds --width, --height, --hfov and --eye-height, with the values of `o` as defaults.
void add_view_options(CLI::App& app, ViewOptions& o);
/// Adds the options that name the scene: --scene (or its name alone), --up, --time and --density.
void add_scene_file_options(CLI::App& app, SceneOptions& o);
/// Adds --mesh: triangles next to the Gaussians.
void add_scene_mesh_option(CLI::App& app, SceneOptions& o);
/// Adds all scene options, with the values of `o` as defaults. See add_device_option for `float64`.
void add_scene_options(CLI::App& app, SceneOptions& o, bool* float64 = nullptr);

/// A scene option that has no effect in a program, and why.
struct UnusedOption {
  const char *name, *why;
};
/// Makes the options errors with these reasons, so that each program knows the one set of scene options.
void refuse_scene_options(CLI::App& app, std::initializer_list<UnusedOption> unused);

/// Converts the options to those of the library.
gsnav::OpenOptions open_options(const SceneOptions& o);

/// Opens the scene. Prints information to `notes`, and warnings and progress to stderr.
/// @return the errors of gsnav::open_scene.
gsnav::Result<gsnav::OpenedScene> open_scene(const SceneOptions& o, const gsnav::OpenOptions& how,
                                             std::FILE* notes);

/// Rendering quality of the profile.
gsnav::Quality quality_of(const SceneOptions& o);
gsnav::DetailChoice detail_of(const SceneOptions& o, const gsnav::OpenedScene& scene);

}  // namespace gsnav_tools
