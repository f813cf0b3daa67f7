// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "../../tools/common/navmesh_options.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/device/device.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace nav_loop {

/// What the command line asks for.
struct Options : NavMeshOptions {
  std::string scene;     ///< empty: the embedded flat
  double density = 1.0;  ///< of the embedded flat's Gaussians and of people's
  std::string up = "y";
  int avatars = 3;
  int episodes = 10;
  gsnav::Device device;  ///< what renders
  std::uint64_t seed = 1;
  std::string out = "out";
  int width = 256, height = 256;
  double hfov = 90.0;
  double eye_height = 1.5;
  std::string profile = "exact";  ///< exact, fast, lod
  double lod_error = gsnav::LodChoice{}.pixels;
  bool visible_sets = false;  ///< of fast and lod: draw only what is seen from where the agent is
  int frame_every = 10;       ///< 0: no frames
  int shown_episode = -1;     ///< of strip and map; -1: the one that met people most closely
  int max_steps = 500;
};

/// The similarity that turns `up` (x, y, z, with an optional sign) to +Y.
inline gsnav::Result<gsnav::Similarity> upright(const std::string& up) {
  using gsnav::Vec3d;
  const bool negative = !up.empty() && up[0] == '-';
  const std::string axis = !up.empty() && (up[0] == '-' || up[0] == '+') ? up.substr(1) : up;
  constexpr double kQuarter = 1.5707963267948966;
  gsnav::Similarity s;
  if (axis == "y") {
    s.rotation = negative ? gsnav::Quatd{0, 1, 0, 0} : gsnav::Quatd{};
  } else if (axis == "z") {
    s.rotation = gsnav::axis_angle(Vec3d{1, 0, 0}, negative ? kQuarter : -kQuarter);
  } else if (axis == "x") {
    s.rotation = gsnav::axis_angle(Vec3d{0, 0, 1}, negative ? -kQuarter : kQuarter);
  } else {
    return {gsnav::Errc::invalid_argument, "--up " + up + ": must be x, y or z, with an optional sign"};
  }
  return s;
}

}  // namespace nav_loop
