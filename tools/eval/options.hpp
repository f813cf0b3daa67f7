// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "../common/scene_options.hpp"

namespace gsnav_eval {

/// What both programs, and the viewer, are asked for.
struct Options : gsnav_tools::SceneOptions {
  int episodes = 10;
  std::string out = "out";
  int width = 256, height = 256;
  double hfov = 90.0;
  double eye_height = 1.5;
  int max_steps = 500;
  std::string policy = "follower";  ///< follower, greedy, random
  std::string episode_file;         ///< empty: generated
  std::string preset = "avatar";    ///< v1, v2, avatar
};

/// Whether --navmesh names a file.
bool names_navmesh(const Options& options);

/// Scene, people, episodes, body and picture.
void add_scene_options(CLI::App& app, Options& options);
/// These and the policy: the options that decide what happens: an evaluation goes on, and is replayed,
/// only with the same ones.
void add_world_options(CLI::App& app, Options& options);

/// What an option of add_world_options decides.
enum class OptionRole {
  result,  ///< what happens
  file,    ///< what happens, by the content of the file that it names
  view,    ///< the pictures
};
/// An option as a command line has it.
struct OptionValue {
  std::string flag;   ///< with its dashes
  std::string value;  ///< several are lines
  OptionRole role = OptionRole::result;
  bool names_file = false;  ///< the value is a file's name
};
/// All options that decide something: not --out, and not --device, which changes no metric.
std::vector<OptionValue> option_values(const Options& options);
/// Sets those options that `app` was not given from `values`, by the rules of the command line. Errors:
/// invalid_argument, naming the option.
gsnav::Status take_options(const CLI::App& app, const std::vector<OptionValue>& values,
                           Options& options);

}  // namespace gsnav_eval
