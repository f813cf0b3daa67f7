// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "storage.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_report;
using namespace gsnav_test;

namespace {

const StorageCodec& codec(std::string_view name) {
  for (const StorageCodec& c : storage_codecs()) {
    if (c.name == name) return c;
  }
  throw Error(Errc::invalid_argument, std::string(name));
}

GaussianCloud scene() { return random_cloud(7, {.count = 3000, .extent = 20}); }

/// Largest |a - b| in units of half a step; values out of the codec's range must come back at its end.
template <class F>
double worst(const std::vector<float>& a, const std::vector<float>& b, const StorageCodec& c,
             const F& stored) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = std::clamp(stored(static_cast<double>(a[i])), c.low, c.high),
                 y = stored(static_cast<double>(b[i]));
    most = std::max(most, std::abs(x - y) / (0.5 * c.step));
  }
  return most;
}

const auto same = [](double x) { return x; };

}  // namespace

TEST_CASE("storage: values come back within half a step") {
  const GaussianCloud a = scene();
  for (const StorageCodec& c : storage_codecs()) {
    CAPTURE(c.name);
    const GaussianCloud b = through_storage(a, c.name).value();
    const bool positions = c.name.substr(0, 8) == "position";
    for (std::size_t k = 0; k < 3; ++k) {
      if (positions && c.name != "position_fp16") {
        CHECK(worst(a.means[k], b.means[k], c, same) <= 1 + 1e-4);  // and float32's own rounding
      }
      if (!positions) CHECK(a.means[k] == b.means[k]);
      if (c.name == "log_scale_8") {
        CHECK(worst(a.scales[k], b.scales[k], c, [](double s) { return std::log(s); }) <= 1 + 1e-4);
      } else {
        CHECK(a.scales[k] == b.scales[k]);
      }
    }
    if (c.name == "opacity_8") CHECK(worst(a.opacities, b.opacities, c, same) <= 1 + 1e-4);
    CHECK((a.opacities == b.opacities) == (c.name != "opacity_8"));
    if (c.name == "sh0_8") CHECK(worst(a.sh0, b.sh0, c, same) <= 1 + 1e-4);
    CHECK((a.sh0 == b.sh0) == (c.name != "sh0_8"));
    const bool bands = c.name.starts_with("shN_");
    if (bands) CHECK(worst(a.shN, b.shN, c, same) <= 1 + 1e-4);
    CHECK((a.shN == b.shN) == !bands);
    CHECK((a.quats == b.quats) == (c.name != "quat_10"));
    CHECK(stored_bytes(a, c) < a.bytes());
  }
  CHECK(a.bytes() - stored_bytes(a, codec("position_fp16")) == a.size() * 3 * 2);
  CHECK(a.bytes() - stored_bytes(a, codec("quat_10")) == a.size() * 12);  // 32 bits are left of 128
  CHECK(a.bytes() - stored_bytes(a, codec("shN_8")) == a.size() * 45 * 3);
  const GaussianCloud compact = through_storage(a, kCompactStorage).value();
  CHECK(compact.compact());
  CHECK(compact.means[0] == a.means[0]);
  CHECK(through_storage(a, "zip").message().find("position_fp16") != std::string::npos);
}

TEST_CASE("storage: quaternions stay of unit length and turn by a known angle at most") {
  const GaussianCloud a = scene(), b = through_storage(a, "quat_10").value();
  const double half = 0.5 * codec("quat_10").step;
  double widest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    double product = 0, norm = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      product += static_cast<double>(a.quats[k][i]) * static_cast<double>(b.quats[k][i]);
      norm += static_cast<double>(b.quats[k][i]) * static_cast<double>(b.quats[k][i]);
    }
    CHECK(norm == doctest::Approx(1).epsilon(1e-6));
    widest = std::max(widest, 1 - std::abs(product));
  }
  // Three components are off by half a step; the largest, at least 1/2, by what that makes of it (sqrt 3
  // half steps). On the sphere 1 - |p.q| = |p - q|^2 / 2.
  const double offset = std::sqrt(3 * half * half + 9 * half * half);
  CHECK(widest <= 0.5 * offset * offset * 1.05);
}

TEST_CASE("storage: float16 rounds to the nearest, ties to even") {
  CHECK(round_to_half(1.0f) == 1.0f);
  CHECK(round_to_half(1.0f + 0x1p-11f) == 1.0f);                // a tie
  CHECK(round_to_half(1.0f + 3 * 0x1p-11f) == 1.0f + 0x1p-9f);  // a tie the other way
  CHECK(round_to_half(1.0f + 0x1.1p-11f) == 1.0f + 0x1p-10f);
  CHECK(round_to_half(2047.4f) == 2047.0f);
  CHECK(round_to_half(-4098.0f) == -4096.0f);  // steps of 4 from 4096 on
  CHECK(round_to_half(1e6f) == 65504.0f);
  CHECK(round_to_half(0x1p-24f) == 0x1p-24f);  // the least subnormal
  CHECK(round_to_half(0x1p-26f) == 0.0f);
  CHECK(round_to_half(0.0f) == 0.0f);
  const GaussianCloud a = scene(), b = through_storage(a, "position_fp16").value();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double x = static_cast<double>(a.means[0][i]), y = static_cast<double>(b.means[0][i]);
    CHECK(std::abs(x - y) <= 0x1p-11 * std::max(std::abs(x), 0x1p-14));
  }
}
