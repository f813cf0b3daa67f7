// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "support/sanitized.hpp"

// Inputs that several hard cases share.

namespace gsnav_test {

/// How many random samples a case draws: `base` times GSNAV_HARD_CASE_SAMPLES (1 where it is not set; a
/// quarter under a sanitizer, which is that much slower).
inline std::size_t sample_count(std::size_t base) {
  const char* factor = std::getenv("GSNAV_HARD_CASE_SAMPLES");
  const double unless_set = kSanitized ? 0.25 : 1.0;
  return static_cast<std::size_t>(static_cast<double>(base) *
                                  (factor != nullptr ? std::atof(factor) : unless_set));
}

/// Standard deviations may be 0: a flat axis.
inline gsnav::RawGaussian gaussian(const gsnav::Vec3d& mean, const gsnav::Vec3d& scales, double opacity,
                                   const std::array<float, 3>& sh0 = {0, 0, 0}) {
  gsnav::RawGaussian g;
  g.mean = mean;
  g.log_scales = {std::log(scales.x), std::log(scales.y), std::log(scales.z)};
  g.opacity_logit = std::log(opacity / (1 - opacity));
  g.sh0 = sh0;
  return g;
}

inline gsnav::GaussianCloud cloud_of(const std::vector<gsnav::RawGaussian>& gaussians) {
  gsnav::GaussianCloudBuilder builder(0);
  for (const gsnav::RawGaussian& g : gaussians) builder.add(g);
  return builder.cloud();
}

/// Size of `axis_camera` in pixels, odd, and not above what lists of regions draw; the pixel on the
/// axis.
inline constexpr int kAxisSize = 63, kAxisMiddle = kAxisSize / 2;
inline constexpr std::size_t kAxisPixel = kAxisMiddle * (kAxisSize + 1);

/// Camera at the origin that looks along +z; an odd size has a pixel centre on the axis.
inline gsnav::Camera axis_camera(int size = kAxisSize, double f = 64) {
  gsnav::Camera c;
  c.width = c.height = size;
  c.fx = c.fy = f;
  c.cx = c.cy = 0.5 * size;
  return c;
}

inline gsnav::Quatd random_rotation(gsnav::Rng& rng) {
  gsnav::Quatd q{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
  gsnav::normalize(q);
  return q;
}

/// Shapes from spheres to needles and disks of 1e5 : 1 (a ratio of variances of 1e10), anywhere in front
/// of `axis_camera` and beside it, opacities over all that is drawn.
inline gsnav::GaussianCloud needle_cloud(std::uint64_t seed, std::size_t count) {
  gsnav::Rng rng(seed);
  std::vector<gsnav::RawGaussian> gaussians(count);
  for (gsnav::RawGaussian& g : gaussians) {
    const double z = std::pow(10.0, rng.uniform(-0.5, 1.5));
    const double scale = z * std::pow(10.0, rng.uniform(-3, 1));
    const gsnav::Vec3d scales{scale, scale * std::pow(10.0, -5 * rng.uniform() * rng.uniform()),
                              scale * std::pow(10.0, rng.uniform(-5, 0))};
    g = gaussian({rng.uniform(-1, 1) * z, rng.uniform(-1, 1) * z, z}, scales, rng.uniform(0.004, 0.999));
    g.quat = random_rotation(rng);
  }
  return cloud_of(gaussians);
}

/// The cloud in chunks, as it is when it is loaded.
inline gsnav::GaussianCloud sorted(gsnav::GaussianCloud cloud) {
  gsnav::sort_spatially(cloud);
  return cloud;
}

/// Every image there is.
inline gsnav::RenderConfig all_outputs() {
  gsnav::RenderConfig c;
  c.outputs = gsnav::kRgb | gsnav::kAlpha | gsnav::kAnyDepth;
  return c;
}

template <class S>
bool all_finite(const gsnav::Frames<S>& f) {
  const auto finite = [](const std::vector<S>& image) {
    return std::all_of(image.begin(), image.end(), [](S v) { return gsnav::is_finite(v); });
  };
  return finite(f.rgb) && finite(f.alpha) && finite(f.median_depth) && finite(f.expected_depth) &&
         finite(f.accumulated_depth) && finite(f.first_hit_depth);
}

}  // namespace gsnav_test
