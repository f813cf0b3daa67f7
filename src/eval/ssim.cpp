// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/eval/ssim.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "plane.hpp"

namespace gsnav::eval {
namespace {

using detail::Border;
using detail::Plane;

constexpr int kRadius = 5;
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;  // (K L)^2 with L = 1.

std::vector<double> window(int side) {
  return detail::unit_sum(
      detail::gaussian_taps(0.5 / (kSigma * kSigma), std::min(kRadius, (side - 1) / 2)));
}

Plane product(const Plane& a, const Plane& b) {
  Plane out(a.width, a.height);
  std::transform(a.values.begin(), a.values.end(), b.values.begin(), out.values.begin(),
                 [](double x, double y) { return x * y; });
  return out;
}

double mean_ssim(const Plane& x, const Plane& y, const std::vector<double>& row,
                 const std::vector<double>& column) {
  const auto blur = [&](const Plane& p) { return detail::filter(p, row, column, Border::valid).values; };
  const std::vector<double> mx = blur(x), my = blur(y), mxx = blur(product(x, x)),
                            myy = blur(product(y, y)), mxy = blur(product(x, y));
  double sum = 0.0;
  for (std::size_t i = 0; i < mx.size(); ++i) {
    const double xx = mx[i] * mx[i], yy = my[i] * my[i], xy = mx[i] * my[i];
    sum += (2.0 * xy + kC1) * (2.0 * (mxy[i] - xy) + kC2) /
           ((xx + yy + kC1) * ((mxx[i] - xx) + (myy[i] - yy) + kC2));
  }
  return sum / static_cast<double>(mx.size());
}

}  // namespace

Result<Ssim> ssim(Samples reference, Samples test, int width, int height) {
  if (Status s = detail::check_rgb("ssim", reference, test, width, height); !s) return s;
  const std::array<Plane, 3> x = detail::clamped_planes(reference, width, height),
                             y = detail::clamped_planes(test, width, height);
  const std::vector<double> row = window(width), column = window(height);
  Ssim out;
  for (std::size_t c = 0; c < 3; ++c) out.channel[c] = mean_ssim(x[c], y[c], row, column);
  out.mean = std::accumulate(out.channel.begin(), out.channel.end(), 0.0) / 3.0;
  return out;
}

}  // namespace gsnav::eval
