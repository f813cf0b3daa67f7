// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// Two closed rooms of 3 x 3 x 2.5 m side by side along x, Y up, floor at 0: x from -3.2 to -0.2 and
/// from 0.2 to 3.2. Nothing of one is seen from the other. In spatial order.
inline gsnav::GaussianCloud two_rooms(std::uint64_t seed, int per_side = 400) {
  gsnav::Rng rng(seed);
  gsnav::GaussianCloudBuilder builder(0);
  for (const double left : {-3.2, 0.2}) {
    const gsnav::Vec3d low{left, 0, -1.5}, high{left + 3, 2.5, 1.5};
    for (int side = 0; side < 6; ++side) {
      for (int i = 0; i < per_side; ++i) {
        gsnav::RawGaussian g;
        for (int k = 0; k < 3; ++k) g.mean[k] = rng.uniform(low[k], high[k]);
        g.mean[side / 2] = (side % 2 == 0 ? low : high)[side / 2];
        g.quat = {1, 0, 0, 0};
        g.log_scales = {std::log(0.16), std::log(0.16), std::log(0.16)};
        g.log_scales[side / 2] = std::log(0.004);
        g.opacity_logit = 5;
        for (std::size_t k = 0; k < 3; ++k) g.sh0[k] = static_cast<float>(rng.uniform(-1.5, 1.5));
        builder.add(g);
      }
    }
  }
  gsnav::GaussianCloud cloud = builder.cloud();
  gsnav::sort_spatially(cloud);
  return cloud;
}

/// Places on a grid of 0.5 m in both rooms, at a height of 1.3 m and half a metre or more from walls.
inline std::vector<gsnav::Vec3d> places_in_rooms() {
  std::vector<gsnav::Vec3d> out;
  for (const double left : {-3.2, 0.2}) {
    for (int i = 1; i < 6; ++i) {
      for (int j = 1; j < 6; ++j) out.push_back({left + 0.5 * i, 1.3, -1.5 + 0.5 * j});
    }
  }
  return out;
}

}  // namespace gsnav_test
