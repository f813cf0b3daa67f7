// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "../common/scene_options.hpp"

namespace CLI {
class App;
}

namespace gsnav_eval {

/// Options shared by the programs and the viewer.
struct Options : gsnav_tools::SceneOptions, gsnav_tools::ViewOptions {
  int episodes = 10;
  std::string out = "out";
  int max_steps = 500;
  std::string policy = "follower";  ///< One of follower, greedy, random.
  std::string episode_file;         ///< Empty: generate episodes.
  std::string preset = "avatar";    ///< One of v1, v2, avatar.
};

/// Returns true if --navmesh names a file.
bool names_navmesh(const Options& options);

/// Adds options of the scene, people, episodes, body and images.
void add_scene_options(CLI::App& app, Options& options);
/// Adds the options of add_scene_options and the policy. These determine the outcome, so an evaluation
/// can be continued or replayed only with the same values.
void add_world_options(CLI::App& app, Options& options);

/// Effect of an option of add_world_options.
enum class OptionRole {
  result,  ///< Affects the outcome.
  file,    ///< Affects the outcome through the content of a file.
  view,    ///< Affects the images only.
};
/// An option as given on a command line.
struct OptionValue {
  std::string flag;   ///< Name of the option, with its dashes.
  std::string value;  ///< Several values are separated by line breaks.
  OptionRole role = OptionRole::result;
  bool names_file = false;  ///< The value is the name of a file.
};
/// All options that affect an evaluation. Excludes --out, and --device, which changes no metric.
std::vector<OptionValue> option_values(const Options& options);
/// Sets the options that are missing on the command line of `app` to `values`, with the checks of the
/// command line.
/// @return invalid_argument, with the option.
gsnav::Status take_options(const CLI::App& app, const std::vector<OptionValue>& values,
                           Options& options);

}  // namespace gsnav_eval
