// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gsnav/math/similarity.hpp"
#include "gsnav/nav.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_navmesh {

/// Kind of a file, by its name.
enum class InputKind { navmesh, mesh, gaussians };
InputKind kind_of(const std::string& input);

/// Triangles of an object in the scene.
struct StaticObject {
  std::string file;
  gsnav::Similarity placed;
};

struct Options {
  std::string input;
  std::string up = "auto";
  double scale = 1.0;
  std::string mesh;  ///< Triangles in addition to the Gaussians of the input.
  std::vector<StaticObject> objects;
  std::string out, obj, png, settings_out;
  int mset_version = 2;  ///< Version of `out`.
  gsnav::NavMeshSettings settings;
  int threads = 0;  ///< Threads that build tiles. 0: one per core.
  gsnav::GaussianNavOptions gaussians;
  std::vector<double> crop;      ///< World box as x0 y0 z0 x1 y1 z1. Empty: the whole scene.
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
