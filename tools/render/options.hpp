// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../common/scene_options.hpp"

namespace gsnav_render {

using namespace gsnav;

/// Image that --depth selects. First-hit depth may have its own tau.
struct DepthChoice {
  Output output = kMedianDepth;
  double tau = 0.5;
};

struct Options : gsnav_tools::SceneOptions {
  std::string cameras, out, depth = "median", composite = "merged";
  std::vector<double> eye, target;  ///< Positions x y z.
  bool float64 = false;             ///< Use the float64 reference, on any device.
  DepthChoice depth_choice;
  int width = 0, height = 0, orbit = 0;
  double hfov = 60, near_plane = 0.2, max_alpha = 0.99, depth_near = 0, depth_far = 0;
  bool npy = false, png = false, ledger = false;
};

/// Prints "gsnav-render: `message`". Returns the exit status.
int fail(const std::string& message);

/// Parses options. Returns the exit status if there is nothing to render: --help, or options that cannot
/// be combined.
std::optional<int> parse_options(int argc, char** argv, Options& o);

}  // namespace gsnav_render
