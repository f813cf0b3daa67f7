// SPDX-License-Identifier: Apache-2.0
#include "gsnav/eval/image_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "statistics.hpp"

namespace gsnav::eval {
namespace {

double clamped_error(double reference, double test) noexcept {
  const double e = std::fabs(std::clamp(test, 0.0, 1.0) - std::clamp(reference, 0.0, 1.0));
  return std::isnan(e) ? std::numeric_limits<double>::infinity() : e;
}

}  // namespace

Result<ImageError> image_error(Samples reference, Samples test, std::size_t channels,
                               std::span<const std::uint8_t> excluded) {
  const std::size_t n = reference.size();
  if (n == 0 || test.size() != n || channels == 0 || n % channels != 0) {
    return {Errc::invalid_argument, std::string("image_error: ") + std::to_string(n) + " and " +
                                        std::to_string(test.size()) + " values of " +
                                        std::to_string(channels) + " channels"};
  }
  const std::size_t pixels = n / channels;
  if (!excluded.empty() && excluded.size() != pixels) {
    return {Errc::invalid_argument, std::string("image_error: a mask of ") +
                                        std::to_string(excluded.size()) + " for " +
                                        std::to_string(pixels) + " pixels"};
  }
  constexpr std::array<double, 3> limits{0.5 / 255.0, 1.0 / 255.0, 2.0 / 255.0};
  std::array<std::size_t, 3> over{};
  std::vector<double> errors;
  errors.reserve(n);
  double squares = 0.0, all_squares = 0.0;
  ImageError out;
  for (std::size_t p = 0; p < pixels; ++p) {
    const bool judged = excluded.empty() || excluded[p] == 0;
    double largest = 0.0;
    for (std::size_t c = 0; c < channels; ++c) {
      const double e = clamped_error(reference[p * channels + c], test[p * channels + c]);
      all_squares += e * e;
      if (!judged) continue;
      squares += e * e;
      errors.push_back(e);
      largest = std::max(largest, e);
    }
    if (!judged) continue;
    ++out.pixels;
    out.max = std::max(out.max, largest);
    for (std::size_t k = 0; k < limits.size(); ++k) over[k] += largest > limits[k] ? 1 : 0;
  }
  if (!errors.empty()) out.rmse = std::sqrt(squares / static_cast<double>(errors.size()));
  out.p999 = detail::percentile(errors, 0.999);
  out.psnr = -10.0 * std::log10(all_squares / static_cast<double>(n));
  out.over_half_lsb = detail::share(over[0], out.pixels);
  out.over_lsb = detail::share(over[1], out.pixels);
  out.over_2lsb = detail::share(over[2], out.pixels);
  out.excluded = detail::share(pixels - out.pixels, pixels);
  return out;
}

}  // namespace gsnav::eval
