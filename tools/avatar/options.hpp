// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/math/vec.hpp"

namespace gsnav_avatar {

/// Source of a clip.
struct ClipSource {
  std::string clip;    ///< A file (.bvh, .amc, .glb, .gltf, or a driver's .npz), or the name of a clip
                       ///< in the body's own file.
  std::string asf;     ///< Skeleton of an .amc file.
  double scale = 0.0;  ///< Metres per unit of the clip's file. 0 takes the unit that the .asf file
                       ///< names, and for other files 1.
  bool z_up = false;   ///< Whether z is the clip's up axis, instead of y.
};

/// Options of from-gltf and from-makehuman.
struct MeshCommand {
  std::string input, out, driver;
  std::vector<std::string> skins;                       // For glTF. Empty: all.
  double scale = 1.0;                                   // Metres per unit of the input.
  std::string skeleton, weights;                        // For MakeHuman.
  std::vector<std::pair<std::string, double>> targets;  // For MakeHuman.
  ClipSource clip;
  std::size_t gaussians = 100000;
  std::uint64_t seed = 1;
  int influences = 0;
  double percentile = 0.99;
  double shade = 0.0;
  std::string skinning = "linear";
};

struct WalkCommand {
  std::string avatar, navmesh, out;
  gsnav::Vec3d from{}, to{};
  std::vector<gsnav::Vec3d> via;
  ClipSource clip;
  std::size_t first_key = 0, keys = 0;
  double speed = 0.0, frame_rate = 40.0, clearance = 0.2;
  bool lock_feet = true, flat = false;
};

struct StripCommand {
  std::string avatar, driver, scene, out;
  bool flat = false, z_up = false;
  gsnav::Vec3d eye{}, target{};
  int frames = 8, width = 240, height = 320;
  double fov = 50.0, begin = 0.0, end = 0.0;
};

struct Options {
  std::optional<MeshCommand> mesh;
  bool makehuman = false;
  std::optional<WalkCommand> walk;
  std::optional<StripCommand> strip;
};

/// Reads the command line. If there is nothing left to do, prints help or an error and sets `exit_code`.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_avatar
