// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/load_report.hpp"

namespace gsnav {

/// The highest SH band of which any Gaussian has a coefficient that is not zero, 0 to sh_degree.
inline int sh_degree_in_use(const GaussianCloud& cloud) noexcept {
  const auto highest = [&](const auto& bands) {
    int found = 0;
    const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
    for (std::size_t row = 0; row + rest <= bands.size() && rest != 0 && found < cloud.sh_degree; row += rest) {
      for (int degree = cloud.sh_degree; degree > found; --degree) {
        const auto first = bands.begin() + static_cast<std::ptrdiff_t>(row);
        const auto band = first + 3 * (sh_coefficient_count(degree - 1) - 1);
        const auto next = first + 3 * (sh_coefficient_count(degree) - 1);
        // Of binary16, -0 (0x8000) counts as something; the writer of such a file meant no band either.
        if (std::any_of(band, next, [](auto v) { return v != 0; })) found = degree;
      }
    }
    return found;
  };
  return cloud.shN_half.empty() ? highest(cloud.shN) : highest(cloud.shN_half);
}

/// Which way is up, and what says so.
struct UpGuess {
  Vec3d up{};         ///< a unit axis of the asset's frame; zero of an empty cloud
  bool seen = false;  ///< the cloud's shape says so; false: `usual` is what it is
};

/// Guesses which way is up. A room or a street is flatter along the vertical than along both others, and more stands
/// on its floor than hangs from its ceiling. Objects show neither: then `usual` is returned. A guess for people to
/// check, one of +y, -y and +z, which are all that tools make: nothing in the library turns a scene by it.
inline UpGuess guess_up(const GaussianCloud& cloud, const Vec3d& usual = {0, -1, 0}) {
  constexpr std::size_t kSample = 1 << 16;
  constexpr double kOutliers = 0.03, kFlat = 0.6, kUndecided = 0.03;
  if (cloud.size() == 0) return {};
  const std::size_t n = std::min(cloud.size(), kSample);
  std::array<double, 3> size{}, lean{};
  std::vector<double> along(n);
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < n; ++i) along[i] = cloud.mean(i * cloud.size() / n)[k];
    const auto at = [&](double share) {
      const auto place = along.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(n - 1));
      std::nth_element(along.begin(), place, along.end());
      return *place;
    };
    const double low = at(kOutliers), high = at(1 - kOutliers);
    const std::size_t axis = static_cast<std::size_t>(k);
    size[axis] = high - low;
    if (high > low) lean[axis] = ((low + high) / 2 - at(0.5)) / (high - low);
  }
  const std::size_t axis = size[1] <= size[2] ? 1 : 2, other = 3 - axis;
  if (!(size[axis] < kFlat * std::min(size[0], size[other]))) return {usual, false};
  const double before = usual[static_cast<int>(axis)];
  Vec3d up{};
  up[static_cast<int>(axis)] = lean[axis] > kUndecided ? 1 : lean[axis] < -kUndecided ? -1 : before != 0 ? before : 1;
  if (up.z < 0) return {usual, false};  // no tool's: a flat object
  return {up, true};
}

/// Fills in what a report says of the cloud as a whole: SH bands in use, filter, order, memory, up.
inline void describe(const GaussianCloud& cloud, LoadReport& report, const Vec3d& usual_up = {0, -1, 0}) {
  report.sh_degree_used = sh_degree_in_use(cloud);
  report.filter = cloud.filter;
  report.eps2d = cloud.eps2d;
  report.sort_order = cloud.sort_order;
  report.memory = cloud.bytes();
  report.compact = !cloud.shN_half.empty();
  const UpGuess guess = guess_up(cloud, usual_up);
  report.up = guess.up;
  report.up_seen = guess.seen;
}

}  // namespace gsnav
