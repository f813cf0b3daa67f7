// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "gsnav/demo.hpp"

namespace gsnav_scene {

/// What is written of a scene. Empty names are not written.
struct Outputs {
  std::string scene, mesh, cameras;
  std::string folder;  ///< to make, for all of them
};

/// A scene to make and to write.
struct SceneCommand {
  bool rooms = false;  ///< a floor plan of `plan`; else the embedded flat
  gsnav::FloorPlanOptions plan;
  gsnav::SceneSampling sampling;
  gsnav::IndoorViewOptions views;
  Outputs out;
};

struct HumanoidCommand {
  std::uint64_t seed = 0;  ///< 0: the demo's person
  int gaussians = 30000;
  std::string out;
};

struct Options {
  std::optional<SceneCommand> scene;
  std::optional<HumanoidCommand> humanoid;
};

/// Reads the command line; prints help, or what is wrong, and sets `exit_code` where nothing is left to
/// do.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_scene
