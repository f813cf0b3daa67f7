// SPDX-License-Identifier: Apache-2.0
#include "flip_filters.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

namespace gsnav::eval::detail {
namespace {

constexpr double kPi = std::numbers::pi;

/// Term a sqrt(pi / b) exp(-pi^2 x^2 / b) of a contrast sensitivity filter, with x in degrees.
struct CsfTerm {
  double a, b;
};
constexpr CsfTerm kAchromatic[] = {{1.0, 0.0047}};
constexpr CsfTerm kRedGreen[] = {{1.0, 0.0053}};
constexpr CsfTerm kBlueYellow[] = {{34.1, 0.04}, {13.5, 0.025}};
constexpr double kLargestB = 0.04;

/// Applies a sum of radial Gaussians. The sum is not separable, but each of its terms is.
template <std::size_t N>
Plane csf_filter(const Plane& image, const CsfTerm (&terms)[N], double pixels_per_degree) {
  // Three standard deviations of the widest term. All channels use it.
  const int radius =
      static_cast<int>(std::ceil(3.0 * std::sqrt(kLargestB / (2.0 * kPi * kPi)) * pixels_per_degree));
  std::vector<double> taps[N];
  double weight[N], total = 0.0;
  for (std::size_t i = 0; i < N; ++i) {
    taps[i] = gaussian_taps(kPi * kPi / (terms[i].b * pixels_per_degree * pixels_per_degree), radius);
    const double sum = std::accumulate(taps[i].begin(), taps[i].end(), 0.0);
    weight[i] = terms[i].a * std::sqrt(kPi / terms[i].b) * sum * sum;
    total += weight[i];
    taps[i] = unit_sum(std::move(taps[i]));
  }
  Plane out(image.width, image.height);
  for (std::size_t i = 0; i < N; ++i) {
    const Plane part = filter(image, taps[i], taps[i], Border::replicate);
    for (std::size_t p = 0; p < out.values.size(); ++p) {
      out.values[p] += weight[i] / total * part.values[p];
    }
  }
  return out;
}

/// Scales the positive taps to a sum of 1 and the negative taps to a sum of -1.
std::vector<double> balanced(std::vector<double> taps) {
  double positive = 0.0, negative = 0.0;
  for (const double tap : taps) (tap > 0.0 ? positive : negative) += std::fabs(tap);
  for (double& tap : taps) tap /= tap > 0.0 ? positive : negative;
  return taps;
}

std::vector<double> response(const Plane& image, const std::vector<double>& along,
                             const std::vector<double>& across) {
  std::vector<double> x = filter(image, along, across, Border::replicate).values;
  const std::vector<double> y = filter(image, across, along, Border::replicate).values;
  for (std::size_t p = 0; p < x.size(); ++p) x[p] = std::hypot(x[p], y[p]);
  return x;
}

}  // namespace

std::array<Plane, 3> contrast_filtered(const std::array<Plane, 3>& ycxcz, double pixels_per_degree) {
  return {csf_filter(ycxcz[0], kAchromatic, pixels_per_degree),
          csf_filter(ycxcz[1], kRedGreen, pixels_per_degree),
          csf_filter(ycxcz[2], kBlueYellow, pixels_per_degree)};
}

Features detect_features(const Plane& lightness, double pixels_per_degree) {
  constexpr double kFeatureWidth = 0.082;  // Distance from peak to trough of the eye's edge detector,
                                           // degrees.
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3.0 * sigma));
  const std::vector<double> gaussian = gaussian_taps(0.5 / (sigma * sigma), radius);
  std::vector<double> first = gaussian, second = gaussian;  // Derivatives of the Gaussian.
  for (int x = -radius; x <= radius; ++x) {
    const std::size_t i = static_cast<std::size_t>(x + radius);
    first[i] *= -x;
    second[i] *= x * x / (sigma * sigma) - 1.0;
  }
  const std::vector<double> across = unit_sum(gaussian);
  return {response(lightness, balanced(first), across), response(lightness, balanced(second), across)};
}

}  // namespace gsnav::eval::detail
