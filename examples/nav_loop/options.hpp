// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "../../tools/common/scene_options.hpp"

namespace nav_loop {

/// What the command line asks for.
struct Options : gsnav_tools::SceneOptions {
  int episodes = 10;
  std::string out = "out";
  int width = 256, height = 256;
  double hfov = 90.0;
  double eye_height = 1.5;
  int frame_every = 10;    ///< 0: no frames
  int shown_episode = -1;  ///< of strip and map; -1: the one that met people most closely
  int max_steps = 500;
};

}  // namespace nav_loop
