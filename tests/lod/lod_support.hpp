// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// A textured wall at z = 4 and a board before it, of small flat Gaussians, in spatial order.
inline gsnav::GaussianCloud small_wall(std::uint64_t seed, int count, int sh_degree = 1) {
  gsnav::Rng rng(seed);
  gsnav::GaussianCloudBuilder builder(sh_degree);
  std::array<float, 45> rest{};
  for (int i = 0; i < count; ++i) {
    gsnav::RawGaussian g;
    const bool board = i % 4 == 0;
    const double half = board ? 0.8 : 2.5;
    g.mean = {half * rng.uniform(-1, 1), half * rng.uniform(-1, 1),
              (board ? 3.0 : 4.0) + 0.003 * rng.normal()};
    g.quat = {1, 0, 0, 0};
    g.log_scales = {std::log(0.02) + 0.3 * rng.normal(), std::log(0.02) + 0.3 * rng.normal(),
                    std::log(0.002)};
    g.opacity_logit = 1 + rng.normal();
    const double stripe = std::sin(3 * g.mean.x) * std::cos(2 * g.mean.y);
    for (std::size_t k = 0; k < 3; ++k) {
      g.sh0[k] = static_cast<float>((board ? 1.0 : -0.5) +
                                    stripe * (0.3 + 0.2 * static_cast<double>(k)) + 0.2 * rng.normal());
    }
    for (auto& c : rest) c = static_cast<float>(0.05 * rng.normal());
    g.shN = sh_degree > 0 ? rest.data() : nullptr;
    builder.add(g);
  }
  gsnav::GaussianCloud cloud = builder.cloud();
  gsnav::sort_spatially(cloud);
  return cloud;
}

}  // namespace gsnav_test
