// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/eval/flip.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "flip_color.hpp"
#include "flip_filters.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "plane.hpp"
#include "statistics.hpp"

namespace gsnav::eval {
namespace {

using detail::Plane;

// Names follow the paper.
constexpr double kQc = 0.7;  // Exponent of the colour difference.
constexpr double kPc = 0.4;  // Fraction of the largest difference that maps to kPt.
constexpr double kPt = 0.95;
constexpr double kQf = 0.5;  // Exponent of the feature difference.

/// An image as the colour and feature pipelines compare it.
struct FlipImage {
  std::vector<Vec3d> color;  // Hunt-adjusted CIELAB after the blur of the eye.
  detail::Features features;
};

FlipImage see(const Samples& rgb, int width, int height, double pixels_per_degree) {
  std::array<Plane, 3> image = detail::clamped_planes(rgb, width, height);
  const std::size_t n = image[0].values.size();
  const auto pixel = [](const std::array<Plane, 3>& planes, std::size_t p) {
    return Vec3d{planes[0].values[p], planes[1].values[p], planes[2].values[p]};
  };
  for (std::size_t p = 0; p < n; ++p) {
    Vec3d linear = pixel(image, p);
    for (int c = 0; c < 3; ++c) linear[c] = linear_from_srgb(linear[c]);
    const Vec3d opponent = detail::ycxcz_from_xyz(detail::xyz_from_linear(linear));
    for (int c = 0; c < 3; ++c) image[static_cast<std::size_t>(c)].values[p] = opponent[c];
  }
  FlipImage seen;
  const std::array<Plane, 3> blurred = detail::contrast_filtered(image, pixels_per_degree);
  seen.color.reserve(n);
  for (std::size_t p = 0; p < n; ++p) {
    Vec3d linear = detail::linear_from_xyz(detail::xyz_from_ycxcz(pixel(blurred, p)));
    for (int c = 0; c < 3; ++c) linear[c] = std::clamp(linear[c], 0.0, 1.0);
    seen.color.push_back(detail::hunt_lab_from_xyz(detail::xyz_from_linear(linear)));
  }
  Plane lightness = std::move(image[0]);
  for (double& y : lightness.values) y = (y + 16.0) / 116.0;
  seen.features = detail::detect_features(lightness, pixels_per_degree);
  return seen;
}

/// Largest colour difference in sRGB (green to blue), raised to kQc.
double largest_difference() {
  const auto lab = [](const Vec3d& rgb) {
    return detail::hunt_lab_from_xyz(detail::xyz_from_linear(rgb));
  };
  return std::pow(detail::hyab(lab({0.0, 1.0, 0.0}), lab({0.0, 0.0, 1.0})), kQc);
}

/// Maps differences up to kPc of the largest to [0, kPt], and larger ones to [kPt, 1].
double redistribute(double difference, double largest) {
  const double knee = kPc * largest;
  return difference < knee ? kPt / knee * difference
                           : kPt + (difference - knee) / (largest - knee) * (1.0 - kPt);
}

}  // namespace

Result<Flip> flip(Samples reference, Samples test, int width, int height, double pixels_per_degree) {
  if (Status s = detail::check_rgb("flip", reference, test, width, height); !s) return s;
  if (!(pixels_per_degree >= 1.0 && pixels_per_degree <= 1000.0)) {
    return {Errc::invalid_argument,
            std::string("flip: pixels_per_degree = ") + std::to_string(pixels_per_degree)};
  }
  const FlipImage a = see(reference, width, height, pixels_per_degree),
                  b = see(test, width, height, pixels_per_degree);
  const double largest = largest_difference();
  Flip out;
  out.map.reserve(a.color.size());
  for (std::size_t p = 0; p < a.color.size(); ++p) {
    const double color = redistribute(std::pow(detail::hyab(a.color[p], b.color[p]), kQc), largest);
    const double edge = std::fabs(a.features.edges[p] - b.features.edges[p]);
    const double point = std::fabs(a.features.points[p] - b.features.points[p]);
    const double feature = std::pow(std::max(edge, point) / std::numbers::sqrt2, kQf);
    const double error = std::clamp(std::pow(color, 1.0 - feature), 0.0, 1.0);
    out.mean += error;
    out.map.push_back(static_cast<float>(error));
  }
  out.mean /= static_cast<double>(out.map.size());
  std::vector<float> sorted = out.map;
  out.p99 = detail::percentile(sorted, 0.99);
  return out;
}

}  // namespace gsnav::eval
