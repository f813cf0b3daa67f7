// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/math/pack.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/math/vec.hpp"

using namespace gsnav;

TEST_CASE("exp2 in float against long double") {
  Rng rng(1);
  double worst5 = 0, worst3 = 0;
  for (int i = 0; i < 1000000; ++i) {
    const float x = static_cast<float>(rng.uniform(-126, 126));
    const long double truth = std::exp2(static_cast<long double>(x));
    worst5 = std::max(worst5, static_cast<double>(std::abs(gsnav::exp2(x) / truth - 1)));
    worst3 = std::max(worst3, static_cast<double>(std::abs(gsnav::exp2<Exp2::degree3>(x) / truth - 1)));
  }
  CHECK(worst5 < 1.8e-7);
  CHECK(worst3 < 1.0e-4);
  CHECK(worst3 > 1e-5);  // else degree 3 would not be what it says
  CHECK(gsnav::exp2(0.0f) == 1.0f);
  CHECK(gsnav::exp2(-1e30f) == gsnav::exp2(-126.0f));
}

TEST_CASE("log2 in float against long double") {
  Rng rng(2);
  double worst = 0;
  for (int i = 0; i < 1000000; ++i) {
    const float x = static_cast<float>(std::exp2(rng.uniform(-120, 120)));
    const long double truth = std::log2(static_cast<long double>(x));
    const double error = static_cast<double>(std::abs(gsnav::log2(x) - truth));
    worst = std::max(worst, error / (1e-7 + 1.2e-7 * static_cast<double>(std::abs(truth))));
  }
  CHECK(worst <= 1.0);
  CHECK(gsnav::log2(1.0f) == 0.0f);
}

TEST_CASE("difference of products keeps what cancellation would lose") {
  Rng rng(3);
  for (int i = 0; i < 100000; ++i) {
    const float a = static_cast<float>(rng.uniform(1, 2)), b = static_cast<float>(rng.uniform(1, 2));
    const float c = a * static_cast<float>(1 + 1e-6 * rng.normal()), d = b;
    const double truth = static_cast<double>(a) * b - static_cast<double>(c) * d;
    const double error = std::abs(difference_of_products(a, b, c, d) - truth);
    CHECK(error <= 1.5 * std::abs(truth) * std::numeric_limits<float>::epsilon() + 1e-45);
  }
}

TEST_CASE("finiteness and clamp") {
  CHECK(is_finite(1.0f));
  CHECK(!is_finite(std::numeric_limits<float>::infinity()));
  CHECK(!is_finite(std::numeric_limits<float>::quiet_NaN()));
  CHECK(!is_finite(std::nan("")));
  CHECK(is_finite(std::numeric_limits<double>::max()));
  CHECK(gsnav::clamp(5.0f, 0.0f, 2.0f) == 2.0f);
  CHECK(gsnav::clamp(-5.0, 0.0, 2.0) == 0.0);
}

TEST_CASE("a byte is the nearest to 255 times a value") {
  for (int k = 0; k < 255; ++k) {
    float v = (static_cast<float>(k) + 0.5f) / 255.0f;
    for (int i = 0; i < 8; ++i) v = std::nextafter(v, 0.0f);
    for (int i = 0; i < 16; ++i, v = std::nextafter(v, 1.0f)) {
      CAPTURE(v);
      CHECK(to_byte(v) == std::lround(255.0f * v));
      CHECK(to_byte(static_cast<double>(v)) == std::lround(255.0 * static_cast<double>(v)));
    }
  }
  CHECK(to_byte(-1.0f) == 0);
  CHECK(to_byte(1.0f) == 255);
  CHECK(to_byte(7.0f) == 255);
  CHECK(to_byte(std::nanf("")) == 0);
}

TEST_CASE("fma is that of the C library, by whatever instruction") {
  Rng rng(5);
  for (int i = 0; i < 200000; ++i) {
    const double a = rng.uniform(-1.0, 1.0), b = rng.uniform(-1e3, 1e3),
                 c = i % 2 == 0 ? -a * b : rng.uniform(-1.0, 1.0);
    CHECK(gsnav::fma(a, b, c) == std::fma(a, b, c));
    const auto af = static_cast<float>(a), bf = static_cast<float>(b),
               cf = i % 2 == 0 ? -af * bf : static_cast<float>(c);
    CHECK(gsnav::fma(af, bf, cf) == std::fma(af, bf, cf));
  }
}

TEST_CASE("the software fma is correctly rounded") {
  Rng rng(4);
  for (int i = 0; i < 1000000; ++i) {
    const float a = float_of_bits(static_cast<std::uint32_t>(rng.next()));
    const float b = float_of_bits(static_cast<std::uint32_t>(rng.next()));
    float c = float_of_bits(static_cast<std::uint32_t>(rng.next()));
    if (i % 2 == 0) c = -static_cast<float>(static_cast<double>(a) * b) * (1 + 1e-6f);  // cancelling
    if (!is_finite(a) || !is_finite(b) || !is_finite(c)) continue;
    const float expected = std::fma(a, b, c), got = detail::fma_by_double(a, b, c);
    // Below the normal range the last conversion rounds a second time.
    if (is_finite(expected) && std::abs(expected) > 1.2e-38f) CHECK(bits_of(expected) == bits_of(got));
  }
}
