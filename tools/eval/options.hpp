// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "../../examples/nav_loop/options.hpp"

namespace gsnav_eval {

/// What both programs are asked for; scene, people and seed as nav_loop has them.
struct Options : nav_loop::Options {
  std::string policy = "follower";     ///< follower, greedy, random
  std::string episode_file;            ///< empty: generated
  std::string preset = "avatar";       ///< v1, v2, avatar
};

/// Scene, people, episodes, body and picture.
void add_scene_options(CLI::App& app, Options& options);
/// These and the policy: the options that decide what happens: an evaluation goes on, and is replayed, only with the same ones.
void add_world_options(CLI::App& app, Options& options);

}  // namespace gsnav_eval
