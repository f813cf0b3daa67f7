// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <unordered_map>

#include "cache.hpp"
#include "csv.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_report {

/// Greatest depth that is judged, metres; the budgets hold up to it.
inline constexpr double kDepthRange = 10.0;

/// Judges images and caches the results, so that equal bits from several sensors or backends are judged
/// once.
class Judge {
 public:
  /// Fills the error columns of `row` with the differences of `frames` from `reference`. `frames` has
  /// one camera; images that were not rendered are empty. `hash` is the reference's hash. Pixels that
  /// rounding alone decides count only in PSNR, SSIM and FLIP.
  gsnav::Status operator()(const gsnav::Frames<float>& frames, const Reference& reference,
                           const std::string& hash, Row& row);

 private:
  std::unordered_map<std::string, Row> colors_;  // by hashes of image and reference
};

}  // namespace gsnav_report
