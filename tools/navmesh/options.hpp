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

/// Kind of a scene, by its name.
enum class InputKind {
  navmesh,    ///< A file of a NavMesh.
  triangles,  ///< A file of triangles.
  scene,  ///< Anything else that gsnav::open_scene opens: Gaussians, or triangles of a Habitat scene.
};
InputKind kind_of(const std::string& scene);

/// Triangles of an object in the scene.
struct StaticObject {
  std::string file;
  gsnav::Similarity placed;
};

struct Options : gsnav_tools::SceneOptions {
  double scale = 1.0;
  std::vector<StaticObject> objects;
  std::string out, obj, png, settings_out;
  int mset_version = 2;  ///< Version of `out`.
  gsnav::NavMeshSettings settings;
  int threads = 0;  ///< Threads that build tiles. 0: one per core.
  bool cell_height_given = false, solid_alpha_given = false;
  gsnav::GaussianNavOptions gaussians;
  std::optional<double> height;  ///< Height of the picture. Empty: that of a level.
  std::optional<std::size_t> level;
  std::string visible_sets;  ///< File to write. Empty: none.
  std::vector<double> eye_heights{1.5};
  gsnav::VisibleSettings visible;
  double metres_per_pixel = 0;  ///< 0: the longer side gets 1200 pixels.
};

/// Reads the command line. If there is nothing left to do, prints help or an error and sets `exit_code`.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_navmesh
