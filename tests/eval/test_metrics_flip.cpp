// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "gsnav/detail/eval/flip.hpp"
#include "images.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

using Real = long double;
using Color = std::array<Real, 3>;
constexpr Real kPi = std::numbers::pi_v<Real>;

// FLIP once more, from the paper: matrices as published for sRGB, filters as 2D sums over the image.

constexpr Real kXyz[3][3] = {{0.41239079926595934L, 0.35758433938387796L, 0.18048078840183429L},
                             {0.21263900587151027L, 0.71516867876775593L, 0.07219231536073371L},
                             {0.01933081871559182L, 0.11919477979462598L, 0.95053215224966059L}};
constexpr Real kRgb[3][3] = {{3.2409699419045226L, -1.5373831775700939L, -0.4986107602930034L},
                             {-0.9692436362808796L, 1.8759675015077202L, 0.0415550574071756L},
                             {0.0556300796969936L, -0.2039769588889765L, 1.0569715142428786L}};
constexpr Real kWhite[3] = {0.95045592705167160L, 1.0L, 1.08905775075987843L};

Color times(const Real (&m)[3][3], const Color& v) {
  Color out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

Real decoded(Real x) { return x <= 0.04045L ? x / 12.92L : std::pow((x + 0.055L) / 1.055L, 2.4L); }
Real encoded(Real x) { return x <= 0.0031308L ? 12.92L * x : 1.055L * std::pow(x, 1 / 2.4L) - 0.055L; }

/// CIELAB of linear sRGB with Hunt's adjustment.
Color lab(const Color& linear) {
  Color f = times(kXyz, linear);
  for (std::size_t i = 0; i < 3; ++i) {
    const Real t = f[i] / kWhite[i];
    f[i] = t > 216.0L / 24389 ? std::cbrt(t) : (24389.0L / 27 * t + 16) / 116;
  }
  const Real l = 116 * f[1] - 16;
  return {l, 5 * l * (f[0] - f[1]), 2 * l * (f[1] - f[2])};
}

Real hyab(const Color& a, const Color& b) {
  return std::fabs(a[0] - b[0]) +
         std::sqrt((a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/// The colour difference redistributed to [0, 1].
Real color_error(const Color& lab_a, const Color& lab_b) {
  const Real largest = std::pow(hyab(lab({0, 1, 0}), lab({0, 0, 1})), 0.7L);
  const Real e = std::pow(hyab(lab_a, lab_b), 0.7L), knee = 0.4L * largest;
  return e < knee ? 0.95L * e / knee : 0.95L + 0.05L * (e - knee) / (largest - knee);
}

struct Kernel {
  int radius;
  std::vector<Real> weights;  // rows of 2 radius + 1
};

template <class F>
Kernel make_kernel(int radius, F&& weight) {
  Kernel k{radius, {}};
  for (int y = -radius; y <= radius; ++y) {
    for (int x = -radius; x <= radius; ++x) k.weights.push_back(weight(Real(x), Real(y)));
  }
  Real positive = 0, negative = 0;
  for (const Real w : k.weights) (w > 0 ? positive : negative) += std::fabs(w);
  for (Real& w : k.weights) w /= w > 0 ? positive : negative;
  return k;
}

/// 2D sum around (x, y); the image continues with its nearest pixel.
template <class F>
Real filtered(const Kernel& k, int width, int height, int x, int y, F&& value) {
  Real sum = 0;
  std::size_t i = 0;
  for (int dy = -k.radius; dy <= k.radius; ++dy) {
    for (int dx = -k.radius; dx <= k.radius; ++dx, ++i) {
      sum += k.weights[i] * value(std::clamp(x + dx, 0, width - 1), std::clamp(y + dy, 0, height - 1));
    }
  }
  return sum;
}

Real csf(Real squared, Real a, Real b) {
  return a * std::sqrt(kPi / b) * std::exp(-kPi * kPi * squared / b);
}

std::vector<Real> direct_flip(const std::vector<double>& a, const std::vector<double>& b, int width,
                              int height, Real ppd) {
  const int r = static_cast<int>(std::ceil(3 * std::sqrt(0.04L / (2 * kPi * kPi)) * ppd));
  const auto q = [ppd](Real x, Real y) { return (x * x + y * y) / (ppd * ppd); };
  const Kernel kernels[3] = {make_kernel(r, [&](Real x, Real y) { return csf(q(x, y), 1, 0.0047L); }),
                             make_kernel(r, [&](Real x, Real y) { return csf(q(x, y), 1, 0.0053L); }),
                             make_kernel(r, [&](Real x, Real y) {
                               return csf(q(x, y), 34.1L, 0.04L) + csf(q(x, y), 13.5L, 0.025L);
                             })};
  const Real s = 0.041L * ppd;
  const int fr = static_cast<int>(std::ceil(3 * s));
  const auto gauss = [s](Real x, Real y) { return std::exp(-(x * x + y * y) / (2 * s * s)); };
  const Kernel features[2][2] = {
      {make_kernel(fr, [&](Real x, Real y) { return -x * gauss(x, y); }),
       make_kernel(fr, [&](Real x, Real y) { return -y * gauss(x, y); })},
      {make_kernel(fr, [&](Real x, Real y) { return (x * x / (s * s) - 1) * gauss(x, y); }),
       make_kernel(fr, [&](Real x, Real y) { return (y * y / (s * s) - 1) * gauss(x, y); })}};

  const auto opponent = [&](const std::vector<double>& image, int x, int y) {
    Color c;
    for (std::size_t i = 0; i < 3; ++i) {
      c[i] = decoded(static_cast<Real>(image[static_cast<std::size_t>(3 * (y * width + x)) + i]));
    }
    c = times(kXyz, c);
    return Color{116 * c[1] - 16, 500 * (c[0] / kWhite[0] - c[1]), 200 * (c[1] - c[2] / kWhite[2])};
  };
  const auto seen = [&](const std::vector<double>& image, int x, int y) {
    Color c;
    for (std::size_t i = 0; i < 3; ++i) {
      c[i] = filtered(kernels[i], width, height, x, y,
                      [&](int u, int v) { return opponent(image, u, v)[i]; });
    }
    const Real luminance = (c[0] + 16) / 116;
    c = times(kRgb,
              {(luminance + c[1] / 500) * kWhite[0], luminance, (luminance - c[2] / 200) * kWhite[2]});
    for (Real& v : c) v = std::clamp(v, Real(0), Real(1));
    return lab(c);
  };
  const auto strength = [&](const std::vector<double>& image, const Kernel(&k)[2], int x, int y) {
    const auto value = [&](int u, int v) { return (opponent(image, u, v)[0] + 16) / 116; };
    return std::hypot(filtered(k[0], width, height, x, y, value),
                      filtered(k[1], width, height, x, y, value));
  };
  std::vector<Real> out;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Real feature = 0;
      for (const auto& k : features) {
        feature = std::max(feature, std::fabs(strength(a, k, x, y) - strength(b, k, x, y)));
      }
      out.push_back(std::pow(color_error(seen(a, x, y), seen(b, x, y)),
                             1 - std::sqrt(feature / std::numbers::sqrt2_v<Real>)));
    }
  }
  return out;
}

}  // namespace

TEST_CASE("flip: 0 for equal images of any size") {
  for (const auto& [w, h] : {std::pair{1, 1}, {1, 30}, {3, 2}, {40, 24}}) {
    const std::vector<double> image = test_image(w, h, 1);
    const Flip f = flip(image, image, w, h).value();
    CHECK(f.mean == 0.0);
    CHECK(f.p99 == 0.0);
    CHECK(f.map.size() == static_cast<std::size_t>(w * h));
  }
}

TEST_CASE("flip: constant images differ as their colours do, wherever one looks") {
  const Color colors[] = {{0, 0, 0}, {1, 1, 1},          {0.5L, 0.5L, 0.5L},   {0.51L, 0.5L, 0.5L},
                          {1, 0, 0}, {0.9L, 0.2L, 0.4L}, {0.01L, 0.02L, 0.03L}};
  for (const Color& a : colors) {
    for (const Color& b : colors) {
      const auto image = [](const Color& c) {
        return constant_image(9, 4, static_cast<double>(c[0]), static_cast<double>(c[1]),
                              static_cast<double>(c[2]));
      };
      const auto linear = [](const Color& c) {
        return Color{decoded(c[0]), decoded(c[1]), decoded(c[2])};
      };
      const double expected = static_cast<double>(color_error(lab(linear(a)), lab(linear(b))));
      const Flip f = flip(image(a), image(b), 9, 4).value();
      CHECK(std::fabs(f.mean - expected) < 1e-6);
      for (const float e : f.map) CHECK(std::fabs(static_cast<double>(e) - expected) < 1e-6);
    }
  }
}

TEST_CASE("flip: green against blue is the largest difference of all, 1") {
  const Flip f = flip(constant_image(3, 3, 0, 1, 0), constant_image(3, 3, 0, 0, 1), 3, 3).value();
  CHECK(f.mean == doctest::Approx(1.0).epsilon(1e-12));
}

TEST_CASE("flip: beside a step from black to white the feature term is that of a full edge") {
  // Half of the edge filter's weights see white, so it answers 1 on both sides of the step; the eye's
  // filter sees half the white, and half its own centre's column more or less.
  constexpr int w = 48, h = 9;
  constexpr Real ppd = kFlipPixelsPerDegree, grey = 0.2L;
  std::vector<double> step = constant_image(w, h, 0, 0, 0);
  for (int y = 0; y < h; ++y) {
    for (int x = w / 2; x < w; ++x) {
      for (int c = 0; c < 3; ++c) step[static_cast<std::size_t>(3 * (y * w + x) + c)] = 1.0;
    }
  }
  const double flat = static_cast<double>(encoded(grey));
  const Flip f = flip(step, constant_image(w, h, flat, flat, flat), w, h).value();
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(0.04L / (2 * kPi * kPi)) * ppd));
  Real sum = 0;
  for (int x = -radius; x <= radius; ++x) sum += csf(Real(x * x) / (ppd * ppd), 1, 0.0047L);
  const Real centre = csf(0, 1, 0.0047L) / sum, feature = std::sqrt(1 / std::numbers::sqrt2_v<Real>);
  for (const auto& [x, level] : {std::pair{w / 2, (1 + centre) / 2}, {w / 2 - 1, (1 - centre) / 2}}) {
    const Real color = color_error(lab({level, level, level}), lab({grey, grey, grey}));
    const double expected = static_cast<double>(std::pow(color, 1 - feature));
    for (const int y : {0, 4, 8}) {
      CHECK(std::fabs(static_cast<double>(f.map[static_cast<std::size_t>(y * w + x)]) - expected) <
            1e-6);
    }
  }
}

TEST_CASE("flip: agrees with 2D sums in long double, pixel by pixel") {
  struct Case {
    int width, height;
    double ppd;
  };
  for (const Case& c : {Case{14, 11, 20.0}, {3, 17, 20.0}, {7, 4, kFlipPixelsPerDegree}, {1, 1, 30.0}}) {
    CAPTURE(c.width);
    const std::vector<double> a = test_image(c.width, c.height, 11), b = with_noise(a, 0.1, 12);
    const Flip f = flip(a, b, c.width, c.height, c.ppd).value();
    const std::vector<Real> expected = direct_flip(a, b, c.width, c.height, c.ppd);
    for (std::size_t p = 0; p < expected.size(); ++p) {
      CHECK(std::fabs(static_cast<double>(f.map[p]) - static_cast<double>(expected[p])) < 1e-6);
    }
  }
}

TEST_CASE("flip: is symmetric, within [0, 1], and grows with noise") {
  const std::vector<double> a = test_image(48, 36, 13);
  double last = 0.0;
  for (const double level : {0.002, 0.01, 0.05, 0.2}) {
    const std::vector<double> b = with_noise(a, level, 14);
    const Flip f = flip(a, b, 48, 36).value();
    CHECK(f.mean > last);
    CHECK(f.p99 > f.mean);
    CHECK(f.map == flip(b, a, 48, 36).value().map);
    for (const float e : f.map) CHECK((e >= 0.0f && e <= 1.0f));
    last = f.mean;
  }
}

TEST_CASE("flip: values beyond [0, 1] are the clamped ones, NaN is 0") {
  std::vector<double> a = test_image(8, 8, 15), wild = a, tame = a;
  wild[5] = 7.0, tame[5] = 1.0;
  wild[6] = -1.0, tame[6] = 0.0;
  wild[9] = std::numeric_limits<double>::quiet_NaN(), tame[9] = 0.0;
  CHECK(flip(a, wild, 8, 8).value().map == flip(a, tame, 8, 8).value().map);
}

TEST_CASE("flip: sizes that disagree and impossible observers are refused") {
  const std::vector<float> twelve(12), nine(9), none;
  CHECK(flip(twelve, nine, 2, 2).code() == Errc::invalid_argument);
  CHECK(flip(none, none, 0, 0).code() == Errc::invalid_argument);
  CHECK(flip(twelve, twelve, -2, -2).code() == Errc::invalid_argument);
  for (const double ppd : {0.0, -67.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(flip(twelve, twelve, 2, 2, ppd).code() == Errc::invalid_argument);
  }
}

TEST_CASE("colorize_error: magma, lighter where the error is larger, clamped at its ends") {
  CHECK(magma(0.0) == std::array<std::uint8_t, 3>{0, 0, 4});
  CHECK(magma(1.0) == std::array<std::uint8_t, 3>{252, 253, 191});
  CHECK(magma(-1.0) == magma(0.0));
  CHECK(magma(9.0) == magma(1.0));
  CHECK(magma(std::numeric_limits<double>::quiet_NaN()) == magma(1.0));
  double last = -1.0;
  for (int i = 0; i <= 100; ++i) {
    const auto c = magma(i / 100.0);
    const double light =
        0.2126 * std::pow(c[0], 2.2) + 0.7152 * std::pow(c[1], 2.2) + 0.0722 * std::pow(c[2], 2.2);
    CHECK(light > last);
    last = light;
  }
  const std::vector<std::uint8_t> bytes = colorize_error(std::vector<float>{0.0f, 0.02f}, 0.02f);
  CHECK(bytes == std::vector<std::uint8_t>{0, 0, 4, 252, 253, 191});
}
