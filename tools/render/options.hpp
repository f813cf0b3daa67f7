// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../common/scene_options.hpp"

namespace gsnav_render {

using namespace gsnav;

/// Which image --depth names; first hit may carry its tau.
struct DepthChoice {
  unsigned output = kMedianDepth;
  double tau = 0.5;
};

struct Options : gsnav_tools::SceneOptions {
  std::string cameras, out, depth = "median", composite = "merged";
  std::vector<double> eye, target;  ///< x y z
  bool float64 = false;             ///< by the float64 reference, whatever the device is
  DepthChoice depth_choice;
  int width = 0, height = 0, orbit = 4;
  double hfov = 60, near_plane = 0.2, max_alpha = 0.99, depth_near = 0, depth_far = 0;
  bool npy = false, png = false, ledger = false;
};

/// Prints "gsnav-render: `message`". Returns the exit status.
int fail(const std::string& message);

/// The exit status where there is nothing to draw: --help, or options that do not go together.
std::optional<int> parse_options(int argc, char** argv, Options& o);

}  // namespace gsnav_render
