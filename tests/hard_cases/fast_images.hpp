// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

#include "gsnav/render/config.hpp"
#include "gsnav/render/frames.hpp"

// Quality::fast on the hard cases: each image that a case draws in double is drawn by `fast` too.

namespace gsnav_test {

/// The settings of a case with those of Quality::fast. Its other settings are kept.
inline gsnav::RenderConfig fast_of(gsnav::RenderConfig config) {
  const gsnav::Quality fast = gsnav::Quality::fast();
  config.quality.exponential = fast.exponential;
  config.quality.transmittance_min = fast.transmittance_min;
  config.quality.normalize_closed = fast.normalize_closed;
  return config;
}

/// Whether the images of a case say how far `fast` is from the contract: not with another renderer's
/// rules, nor if the case itself stops earlier.
inline bool judges_fast(const gsnav::RenderConfig& config) {
  return config.compat == gsnav::Compat::none && config.composite == gsnav::Composite::merged &&
         !config.quality.normalize_closed && config.quality.transmittance_min <= 1e-4;
}

/// CHECKs `fast` against the case's images in double: colours and alpha within 1.2e-3, where colours are
/// divided by the largest one of the images if that is above 1. The exponential changes an alpha by up
/// to 1e-4 of it, and less than 1e-3 of the light passes a closed pixel. Median depths are within a
/// millimetre in 98.5 % of the pixels: elsewhere the transmittance is 1/2 between two surfaces. Pixels
/// that rounding decides are left out, where `exact` in float32 is off by 1e-3. The environment variable
/// GSNAV_FAST_ERRORS names a file that gets the errors, one line for each call.
inline void check_fast(const gsnav::Frames<float>& fast, const gsnav::Frames<float>& exact,
                       const gsnav::Frames<double>& reference) {
  constexpr double kBound = 1.2e-3, kRounding = 1e-3, kMillimetre = 1e-3;
  double scale = 1;
  for (const double value : reference.rgb) scale = std::max(scale, std::abs(value));
  // Calls f(difference) for each value that rounding does not decide.
  const auto each = [](const auto& image, const auto& rounded, const auto& truth, const auto& f) {
    REQUIRE(image.size() == truth.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (std::abs(static_cast<double>(rounded[i]) - truth[i]) > kRounding) continue;
      f(std::abs(static_cast<double>(image[i]) - truth[i]));
    }
  };
  double color = 0, alpha = 0;
  std::size_t far = 0;
  each(fast.rgb, exact.rgb, reference.rgb, [&](double d) { color = std::max(color, d / scale); });
  each(fast.alpha, exact.alpha, reference.alpha, [&](double d) { alpha = std::max(alpha, d); });
  each(fast.median_depth, exact.median_depth, reference.median_depth,
       [&](double d) { far += d > kMillimetre ? 1 : 0; });
  CHECK(color <= kBound);
  CHECK(alpha <= kBound);
  const std::size_t depths = reference.median_depth.size();
  CHECK(static_cast<double>(far) <= 0.015 * static_cast<double>(depths));
  const char* path = std::getenv("GSNAV_FAST_ERRORS");
  if (path == nullptr) return;
  std::FILE* file = std::fopen(path, "a");
  REQUIRE(file != nullptr);
  std::fprintf(file, "%s | %.3g | %.3g | %zu of %zu\n",
               doctest::getContextOptions()->currentTest->m_name, color, alpha, far, depths);
  std::fclose(file);
}

}  // namespace gsnav_test
