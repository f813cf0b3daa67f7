// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/io.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "support/files.hpp"

namespace gsnav_test {

/// A floor of 8 m x 8 m at z = 1 with a wall on two sides, as flat Gaussians; z is up.
inline gsnav::GaussianCloud room_z_up() {
  using namespace gsnav;
  GaussianCloudBuilder builder(0);
  Rng rng(5);
  for (int i = 0; i < 30000; ++i) {
    const bool wall = i % 5 == 0, along_x = i % 10 == 0;
    RawGaussian g;
    g.mean = {rng.uniform(0, 8), rng.uniform(0, 8), 1};
    g.log_scales = {-2.6, -2.6, -5};
    if (wall) {
      const double height = rng.uniform(1, 3.4);
      g.mean = along_x ? Vec3d{g.mean.x, 0, height} : Vec3d{0, g.mean.y, height};
      g.log_scales = along_x ? Vec3d{-2.6, -5, -2.6} : Vec3d{-5, -2.6, -2.6};
    }
    g.quat = {1, 0, 0, 0};
    g.opacity_logit = 6;
    g.sh0 = {wall ? 1.0f : 0.0f, 0.5f, -0.5f};
    builder.add(g);
  }
  return builder.cloud();
}

/// A square floor as a Wavefront OBJ: y up, corners at (+-half, 0, +-half).
inline std::string floor_obj(double half) {
  const std::string h = std::to_string(half);
  return "v -" + h + " 0 -" + h + "\nv -" + h + " 0 " + h + "\nv " + h + " 0 " + h + "\nv " + h +
         " 0 -" + h + "\nf 1 2 3\nf 1 3 4\n";
}

}  // namespace gsnav_test
