// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "../../tools/common/scene_options.hpp"

namespace nav_loop {

/// Options of the command line.
struct Options : gsnav_tools::SceneOptions, gsnav_tools::ViewOptions {
  int episodes = 10;
  std::string out = "out";
  int frame_every = 10;    ///< write every Nth frame; 0 writes none
  int shown_episode = -1;  ///< episode of strip and map; -1: closest encounter
  int max_steps = 500;
};

}  // namespace nav_loop
