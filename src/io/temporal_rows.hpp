// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "cloud_fill.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"

namespace gsnav::io::detail {

/// Time and motion of one Gaussian, as stored in files. Values that a file leaves out are zero.
struct RawTemporal {
  double time = 0;       ///< Seconds.
  double log_sigma = 0;  ///< Natural logarithm, seconds; infinity: always present.
  std::array<double, kMotionPlanes> motion{};
};

/// Collects the time planes of a file's rows, while a CloudSink collects their Gaussians. Any number of
/// threads may add rows.
class TemporalRows {
 public:
  /// For `count` rows with `motion_planes` planes of motion: 0, 3, 6 or 9.
  TemporalRows(std::size_t count, std::size_t motion_planes) {
    planes_.times.resize(count);
    planes_.sigmas.resize(count);
    for (std::size_t k = 0; k < motion_planes; ++k) planes_.motion[k].resize(count);
  }

  /// Adds row `row` to the sink and stores its planes. A row whose planes are not finite counts as not
  /// finite.
  void add(std::size_t row, const RawTemporal& t, RawGaussian raw, CloudSink& sink) noexcept {
    constexpr double kLimit = 20;
    constexpr float kDropped = std::numeric_limits<float>::quiet_NaN();
    const bool always = std::isinf(t.log_sigma) && t.log_sigma > 0;
    const double log_sigma = always ? t.log_sigma : clamp(t.log_sigma, -kLimit, kLimit);
    // Check the floats that are stored.
    bool finite = !std::isnan(t.log_sigma) && is_finite(static_cast<float>(t.time));
    for (const double m : t.motion) finite = finite && is_finite(static_cast<float>(m));
    if (!finite) raw.mean.x = std::numeric_limits<double>::quiet_NaN();
    const bool kept = sink.add(raw);
    if (kept && log_sigma != t.log_sigma) ++clamped_;
    planes_.times[row] = kept ? static_cast<float>(t.time) : kDropped;
    planes_.sigmas[row] = static_cast<float>(std::exp(log_sigma));
    for (std::size_t k = 0; k < kMotionPlanes && !planes_.motion[k].empty(); ++k) {
      planes_.motion[k][row] = static_cast<float>(t.motion[k]);
    }
  }

  /// Moves the planes of the kept rows to `out`, whose cloud has these rows, and fills in the report.
  void give(TemporalCloud& out, LoadReport& report) {
    std::size_t to = 0;
    float first = std::numeric_limits<float>::infinity(), last = -first;
    for (std::size_t row = 0; row < planes_.times.size(); ++row) {
      const float time = planes_.times[row];
      if (std::isnan(time)) continue;
      planes_.times[to] = time;
      planes_.sigmas[to] = planes_.sigmas[row];
      for (auto& plane : planes_.motion) {
        if (!plane.empty()) plane[to] = plane[row];
      }
      if (is_finite(planes_.sigmas[to])) {
        first = min(first, time);
        last = max(last, time);
      }
      ++to;
    }
    planes_.times.resize(to);
    planes_.sigmas.resize(to);
    for (auto& plane : planes_.motion) {
      if (!plane.empty()) plane.resize(to);
    }
    out.times = std::move(planes_.times);
    out.sigmas = std::move(planes_.sigmas);
    out.motion = std::move(planes_.motion);
    if (clamped_ != 0) {
      report.warnings.push_back(std::to_string(clamped_) +
                                " time scales clamped: their logarithms are outside [-20, 20]");
    }
    if (first <= last) {
      report.moving = true;
      report.first_time = static_cast<double>(first);
      report.last_time = static_cast<double>(last);
    }
  }

 private:
  TemporalCloud planes_;  // without its cloud; a dropped row has time NaN
  std::atomic<std::uint64_t> clamped_{0};
};

}  // namespace gsnav::io::detail
