// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <unordered_map>

#include "cache.hpp"
#include "csv.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav_report {

/// Depth is judged to this range, metres: budgets are stated up to it.
inline constexpr double kDepthRange = 10.0;

/// Judges images, and remembers: sensors and backends that give the same bits are judged once.
class Judge {
 public:
  /// Fills the error columns of `row` with what `frames` (one camera; images not rendered are empty)
  /// differs by from `reference`, which `hash` names. Pixels that rounding alone decides are left out of
  /// all but PSNR, SSIM and FLIP.
  gsnav::Status operator()(const gsnav::Frames<float>& frames, const Reference& reference,
                           const std::string& hash, Row& row);

 private:
  std::unordered_map<std::string, Row> colors_;  // by hashes of image and reference
};

}  // namespace gsnav_report
