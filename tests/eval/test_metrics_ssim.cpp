// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/detail/eval/ssim.hpp"
#include "images.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

using Real = long double;

/// SSIM from its definition: each window that fits, weighted variances about the window's own mean.
Real direct_ssim(const std::vector<double>& a, const std::vector<double>& b, int width, int height,
                 int channel) {
  const int rx = std::min(5, (width - 1) / 2), ry = std::min(5, (height - 1) / 2);
  const auto at = [&](const std::vector<double>& image, int x, int y) {
    return static_cast<Real>(image[static_cast<std::size_t>(3 * (y * width + x) + channel)]);
  };
  Real total = 0;
  for (int cy = ry; cy < height - ry; ++cy) {
    for (int cx = rx; cx < width - rx; ++cx) {
      const auto mean = [&](auto&& f) {
        Real sum = 0, weights = 0;
        for (int dy = -ry; dy <= ry; ++dy) {
          for (int dx = -rx; dx <= rx; ++dx) {
            const Real w = std::exp(-Real(dx * dx + dy * dy) / (2 * 1.5L * 1.5L));
            sum += w * f(cx + dx, cy + dy);
            weights += w;
          }
        }
        return sum / weights;
      };
      const Real ma = mean([&](int x, int y) { return at(a, x, y); });
      const Real mb = mean([&](int x, int y) { return at(b, x, y); });
      const Real vab = mean([&](int x, int y) { return (at(a, x, y) - ma) * (at(b, x, y) - mb); });
      const Real va = mean([&](int x, int y) { return (at(a, x, y) - ma) * (at(a, x, y) - ma); });
      const Real vb = mean([&](int x, int y) { return (at(b, x, y) - mb) * (at(b, x, y) - mb); });
      const Real luminance = (2 * ma * mb + 1e-4L) / (ma * ma + mb * mb + 1e-4L);
      total += luminance * (2 * vab + 9e-4L) / (va + vb + 9e-4L);
    }
  }
  return total / ((width - 2 * rx) * (height - 2 * ry));
}

}  // namespace

TEST_CASE("ssim: 1 for equal images of any size") {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 40}, {5, 3}, {11, 11}, {32, 17}}) {
    const std::vector<double> image = test_image(w, h, 1);
    CHECK(ssim(image, image, w, h).value().mean == doctest::Approx(1.0).epsilon(1e-14));
  }
}

TEST_CASE("ssim: of constant images only the luminance term is left") {
  for (const auto& [w, h] : {std::pair{1, 1}, {2, 9}, {16, 16}}) {
    const Ssim s =
        ssim(constant_image(w, h, 0.2, 0.5, 0.0), constant_image(w, h, 0.6, 0.5, 1.0), w, h).value();
    CHECK(s.channel[0] == doctest::Approx((2 * 0.2 * 0.6 + 1e-4) / (0.04 + 0.36 + 1e-4)).epsilon(1e-10));
    CHECK(s.channel[1] == doctest::Approx(1.0).epsilon(1e-10));
    CHECK(s.channel[2] == doctest::Approx(1e-4 / (1.0 + 1e-4)).epsilon(1e-10));
    CHECK(s.mean == doctest::Approx((s.channel[0] + s.channel[1] + s.channel[2]) / 3));
  }
}

TEST_CASE("ssim: agrees with the definition, window by window, in long double") {
  for (const auto& size : {std::pair{23, 14}, {11, 11}, {12, 4}, {3, 30}, {2, 2}, {1, 6}}) {
    const int w = size.first, h = size.second;
    CAPTURE(w);
    CAPTURE(h);
    const std::vector<double> a = test_image(w, h, 5), b = with_noise(a, 0.08, 6);
    const Ssim s = ssim(a, b, w, h).value();
    for (int c = 0; c < 3; ++c) {
      const double expected = static_cast<double>(direct_ssim(a, b, w, h, c));
      CHECK(std::fabs(s.channel[static_cast<std::size_t>(c)] - expected) < 1e-11);
    }
  }
}

TEST_CASE("ssim: is symmetric, and falls as noise grows") {
  const std::vector<double> a = test_image(40, 30, 7);
  double last = 1.0;
  for (const double level : {0.005, 0.02, 0.05, 0.2}) {
    const std::vector<double> b = with_noise(a, level, 8);
    const double s = ssim(a, b, 40, 30).value().mean;
    CHECK(s < last);
    CHECK(s == ssim(b, a, 40, 30).value().mean);
    last = s;
  }
}

TEST_CASE("ssim: floats are read as they are, values beyond [0, 1] as the clamped ones, NaN as 0") {
  const std::vector<double> a = test_image(13, 12, 9);
  std::vector<float> b(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) b[i] = static_cast<float>(1.0 - a[i]);
  std::vector<double> widened(b.begin(), b.end());
  CHECK(ssim(a, b, 13, 12).value().mean == ssim(a, widened, 13, 12).value().mean);
  std::vector<double> wild = widened;
  wild[5] = 7.0, widened[5] = 1.0;
  wild[6] = -1.0, widened[6] = 0.0;
  wild[9] = std::numeric_limits<double>::quiet_NaN(), widened[9] = 0.0;
  CHECK(ssim(a, wild, 13, 12).value().mean == ssim(a, widened, 13, 12).value().mean);
}

TEST_CASE("ssim: sizes that disagree are refused") {
  const std::vector<float> twelve(12), nine(9), none;
  CHECK(ssim(twelve, nine, 2, 2).code() == Errc::invalid_argument);
  CHECK(ssim(nine, twelve, 2, 2).code() == Errc::invalid_argument);
  CHECK(ssim(none, none, 0, 0).code() == Errc::invalid_argument);
  CHECK(ssim(twelve, twelve, -2, -2).code() == Errc::invalid_argument);
  CHECK(ssim(twelve, twelve, 2, 2).ok());
}
