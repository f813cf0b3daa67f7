// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav_test {

/// What a random test cloud is made of.
struct CloudOptions {
  int count = 200;
  int sh_degree = 3;
  double needle = 0.1;  ///< share of 1000 : 1 needles
  double scale = 0.08;  ///< median standard deviation, metres
  gsnav::Vec3d center{0, 0, 4};
  double extent = 1.5;  ///< half side of the box that holds the means
  bool mip = false;
};

/// Random Gaussians in a box, file order random in depth: deterministic by seed.
inline gsnav::GaussianCloud random_cloud(std::uint64_t seed, const CloudOptions& o = {}) {
  gsnav::Rng rng(seed);
  gsnav::GaussianCloudBuilder builder(o.sh_degree);
  std::array<float, 45> rest{};
  for (int i = 0; i < o.count; ++i) {
    gsnav::RawGaussian g;
    for (int k = 0; k < 3; ++k) g.mean[k] = o.center[k] + o.extent * rng.uniform(-1, 1);
    g.quat = {rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    for (int k = 0; k < 3; ++k) g.log_scales[k] = std::log(o.scale) + 0.5 * rng.normal();
    if (rng.uniform() < o.needle) {
      g.log_scales = {std::log(10 * o.scale), std::log(0.01 * o.scale), std::log(0.01 * o.scale)};
    }
    g.opacity_logit = 2.5 * rng.normal();
    for (auto& c : g.sh0) c = static_cast<float>(rng.normal());
    for (auto& c : rest) c = static_cast<float>(0.2 * rng.normal());
    g.shN = o.sh_degree > 0 ? rest.data() : nullptr;
    builder.add(g);
  }
  gsnav::GaussianCloud cloud = builder.cloud();
  if (o.mip) cloud.filter = gsnav::Filter::mip;
  return cloud;
}

/// Errors of one image against another.
struct ImageError {
  double max = 0, p999 = 0, psnr = 0;
};

/// Compares images clamped to [0, 1]; `skip[i / channels]` pixels count only in the PSNR.
template <class A, class B>
ImageError image_error(const std::vector<A>& a, const std::vector<B>& b, std::size_t channels,
                       const std::vector<bool>& skip = {}) {
  ImageError e;
  std::vector<double> kept;
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = std::clamp(static_cast<double>(a[i]), 0.0, 1.0);
    const double y = std::clamp(static_cast<double>(b[i]), 0.0, 1.0);
    const double d = std::abs(x - y);
    squares += d * d;
    if (skip.empty() || !skip[i / channels]) kept.push_back(d);
  }
  std::sort(kept.begin(), kept.end());
  e.max = kept.empty() ? 0 : kept.back();
  e.p999 =
      kept.empty() ? 0 : kept[static_cast<std::size_t>(0.999 * static_cast<double>(kept.size() - 1))];
  e.psnr = -10 * std::log10(std::max(squares / static_cast<double>(a.size()), 1e-30));
  return e;
}

}  // namespace gsnav_test
