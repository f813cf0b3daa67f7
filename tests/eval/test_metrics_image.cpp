// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/eval/depth_error.hpp"
#include "gsnav/eval/image_error.hpp"

using namespace gsnav;
using namespace gsnav::eval;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("image_error: equal images have none, whatever their precision") {
  const std::vector<float> image{0.0f, 0.25f, 0.5f, 1.0f, 0.75f, 2.0f};
  const std::vector<double> same(image.begin(), image.end());
  for (const auto& e : {image_error(image, image, 3).value(), image_error(same, image, 3).value(),
                        image_error(same, same, 1).value()}) {
    CHECK(e.max == 0.0);
    CHECK(e.p999 == 0.0);
    CHECK(e.rmse == 0.0);
    CHECK(e.psnr == kInfinity);
    CHECK(e.over_half_lsb == 0.0);
    CHECK(e.excluded == 0.0);
  }
}

TEST_CASE("image_error: a constant offset d has RMSE d and PSNR -20 log10 d") {
  for (const double d : {1e-6, 1e-3, 0.1}) {
    const std::vector<double> a(300, 0.3), b(300, 0.3 + d);
    const ImageError e = image_error(a, b, 3).value();
    CHECK(e.max == doctest::Approx(d).epsilon(1e-9));
    CHECK(e.p999 == doctest::Approx(d).epsilon(1e-9));
    CHECK(e.rmse == doctest::Approx(d).epsilon(1e-9));
    CHECK(e.psnr == doctest::Approx(-20.0 * std::log10(d)).epsilon(1e-9));
    CHECK(e.pixels == 100);
  }
}

TEST_CASE("image_error: values are clamped as a screen clamps them") {
  const std::vector<double> a{1.0, 0.0, 1.5}, b{7.0, -3.0, 0.5};
  const ImageError e = image_error(a, b, 3).value();
  CHECK(e.max == 0.5);
  CHECK(e.rmse == doctest::Approx(std::sqrt(0.25 / 3.0)));
}

TEST_CASE("image_error: shares count pixels with any channel over 1/2, 1 and 2 LSB") {
  constexpr double lsb = 1.0 / 255.0;
  std::vector<double> a(3 * 8, 0.5), b = a;
  b[0] += 0.4 * lsb;
  b[3] += 0.6 * lsb;
  b[7] -= 1.5 * lsb;
  b[11] += 2.5 * lsb;
  b[9] += 2.5 * lsb;  // another channel of the same pixel
  const ImageError e = image_error(a, b, 3).value();
  CHECK(e.over_half_lsb == 3.0 / 8.0);
  CHECK(e.over_lsb == 2.0 / 8.0);
  CHECK(e.over_2lsb == 1.0 / 8.0);
}

TEST_CASE("image_error: p99.9 leaves out one value of a thousand, not two") {
  std::vector<double> a(1000, 0.0), b = a;
  b[17] = 0.5;
  CHECK(image_error(a, b, 1).value().p999 == 0.0);
  b[900] = 0.25;
  CHECK(image_error(a, b, 1).value().p999 == 0.25);
}

TEST_CASE("image_error: the mask leaves pixels out of everything but PSNR") {
  const std::vector<float> a(12, 0.5f);
  std::vector<float> b = a;
  b[4] = 1.0f;
  b[9] = 0.501f;
  const std::vector<std::uint8_t> mask{0, 1, 0, 0};
  const ImageError all = image_error(a, b, 3).value(), e = image_error(a, b, 3, mask).value();
  CHECK(e.psnr == all.psnr);
  CHECK(all.max == 0.5);
  CHECK(e.max == doctest::Approx(0.001).epsilon(1e-4));
  CHECK(e.rmse == doctest::Approx(0.001 / 3.0).epsilon(1e-4));
  CHECK(e.over_2lsb == 0.0);
  CHECK(e.excluded == 0.25);
  CHECK(e.pixels == 3);
  const ImageError none = image_error(a, b, 3, std::vector<std::uint8_t>(4, 1)).value();
  CHECK(none.pixels == 0);
  CHECK(none.max == 0.0);
  CHECK(none.rmse == 0.0);
  CHECK(none.excluded == 1.0);
}

TEST_CASE("image_error: what is not a number is never a good pixel") {
  const std::vector<double> a{0.5, 0.5}, b{0.5, kNan};
  for (const ImageError& e :
       {image_error(a, b, 1).value(), image_error(b, a, 1).value(), image_error(b, b, 1).value()}) {
    CHECK(e.max == kInfinity);
    CHECK(e.psnr == -kInfinity);
    CHECK(e.over_2lsb == 0.5);
  }
}

TEST_CASE("image_error: is symmetric, and more noise is more error") {
  Rng rng(3);
  std::vector<double> a(300), n(300);
  for (double& v : a) v = rng.uniform(0.3, 0.7);
  for (double& v : n) v = rng.normal();
  double last = 0.0;
  for (const double level : {1e-5, 1e-4, 1e-3, 1e-2, 5e-2}) {
    std::vector<double> b = a;
    for (std::size_t i = 0; i < b.size(); ++i) b[i] += level * n[i];
    const ImageError e = image_error(a, b, 3).value(), r = image_error(b, a, 3).value();
    CHECK(e.rmse > last);
    CHECK(e.max >= e.p999);
    CHECK(e.p999 >= e.rmse);
    CHECK(e.max == r.max);
    CHECK(e.psnr == r.psnr);
    last = e.rmse;
  }
}

TEST_CASE("image_error: sizes that disagree are refused") {
  const std::vector<float> three(3), six(6), none;
  const std::vector<std::uint8_t> mask(2);
  CHECK(image_error(three, six, 3).code() == Errc::invalid_argument);
  CHECK(image_error(none, none, 3).code() == Errc::invalid_argument);
  CHECK(image_error(six, six, 4).code() == Errc::invalid_argument);
  CHECK(image_error(six, six, 0).code() == Errc::invalid_argument);
  CHECK(image_error(three, three, 3, mask).code() == Errc::invalid_argument);
  CHECK(image_error(three, three, 3).ok());
}

TEST_CASE("depth_error: percentiles over the pixels that are opaque and not masked") {
  std::vector<double> z(200), t, alpha(200, 1.0);
  for (std::size_t i = 0; i < z.size(); ++i) z[i] = 2.0;
  t = z;
  for (std::size_t i = 0; i < 100; ++i) t[i] += 0.001 * static_cast<double>(i + 1);  // 1 .. 100 mm
  for (std::size_t i = 100; i < 200; ++i) alpha[i] = i % 2 == 0 ? 0.9 : kNan;        // not above 0.9
  DepthError e = depth_error(z, t, alpha).value();
  CHECK(e.pixels == 100);
  CHECK(e.p50 == doctest::Approx(0.050));
  CHECK(e.p99 == doctest::Approx(0.099));
  CHECK(e.max == doctest::Approx(0.100));
  CHECK(e.abs_rel_p90 == doctest::Approx(0.045));
  CHECK(e.missing == 0.0);

  std::vector<std::uint8_t> mask(200, 0);
  for (std::size_t i = 50; i < 100; ++i) mask[i] = 1;
  e = depth_error(z, t, alpha, mask).value();
  CHECK(e.max == doctest::Approx(0.050));
  CHECK(e.excluded == 0.25);
}

TEST_CASE("depth_error: a return in one image only is missing, not an error of metres") {
  const std::vector<float> z{1.0f, 0.0f, 2.0f, 0.0f, 3.0f}, alpha(5, 1.0f);
  const std::vector<float> t{0.0f, 1.0f, 2.0f, 0.0f, static_cast<float>(kNan)};
  const DepthError e = depth_error(z, t, alpha).value();
  CHECK(e.missing == doctest::Approx(3.0 / 5.0));
  CHECK(e.max == 0.0);
}

TEST_CASE("depth_error: the range limit is the reference's") {
  const std::vector<double> z{5.0, 20.0}, t{5.5, 25.0}, alpha{1.0, 1.0};
  DepthErrorOptions near;
  near.max_range = 10.0;
  CHECK(depth_error(z, t, alpha).value().max == 5.0);
  const DepthError e = depth_error(z, t, alpha, {}, near).value();
  CHECK(e.max == 0.5);
  CHECK(e.abs_rel_p90 == 0.1);
  CHECK(e.pixels == 1);
}

TEST_CASE("depth_error: sizes that disagree are refused") {
  const std::vector<float> two(2), three(3), none;
  CHECK(depth_error(two, three, two).code() == Errc::invalid_argument);
  CHECK(depth_error(two, two, three).code() == Errc::invalid_argument);
  CHECK(depth_error(none, none, none).code() == Errc::invalid_argument);
  CHECK(depth_error(two, two, two, std::vector<std::uint8_t>(1)).code() == Errc::invalid_argument);
}
