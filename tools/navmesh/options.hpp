// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../common/scene_options.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_navmesh {

/// What a scene's name stands for, as far as the name says.
enum class InputKind {
  navmesh,    ///< a file of one
  triangles,  ///< a file of triangles
  scene,      ///< what gsnav::open_scene opens: Gaussians, or triangles of a Habitat scene
};
InputKind kind_of(const std::string& scene);

/// Triangles that stand in the scene.
struct StaticObject {
  std::string file;
  gsnav::Similarity placed;
};

struct Options : gsnav_tools::SceneOptions {
  double scale = 1.0;
  std::vector<StaticObject> objects;
  std::string out, obj, png, settings_out;
  int mset_version = 2;  ///< of `out`
  gsnav::NavMeshSettings settings;
  int threads = 0;  ///< that share out the tiles; 0: one a core
  bool cell_height_given = false, solid_alpha_given = false;
  gsnav::GaussianNavOptions gaussians;
  std::optional<double> height;  ///< of the picture; a level's where it is not given
  std::optional<std::size_t> level;
  std::string visible_sets;  ///< file to write; empty: none
  std::vector<double> eye_heights{1.5};
  gsnav::VisibleSettings visible;
  double metres_per_pixel = 0;  ///< 0: the longer side gets 1200 pixels
};

/// Reads the command line; prints help or what is wrong and sets `exit_code` where nothing is left to
/// do.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_navmesh
