// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "gsnav/demo.hpp"

namespace gsnav_scene {

/// Outputs of a scene. Empty names are not written.
struct Outputs {
  std::string scene, mesh, cameras;
  std::string folder;  ///< Folder to create for all of them.
};

/// A scene to make and write.
struct SceneCommand {
  bool rooms = false;  ///< Make a floor plan from `plan`. False: the embedded flat.
  gsnav::FloorPlanOptions plan;
  gsnav::SceneSampling sampling;
  gsnav::IndoorViewOptions views;
  Outputs out;
};

struct HumanoidCommand {
  std::uint64_t seed = 0;  ///< 0: the person of the demo.
  int gaussians = 30000;
  std::string out;
};

struct Options {
  std::optional<SceneCommand> scene;
  std::optional<HumanoidCommand> humanoid;
};

/// Reads the command line. If there is nothing left to do, prints help or an error and sets `exit_code`.
std::optional<Options> parse_options(int argc, char** argv, int& exit_code);

}  // namespace gsnav_scene
