// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Which pixels depth_error judges.
struct DepthErrorOptions {
  double min_alpha = 0.9;  ///< the reference's alpha is above it
  double max_range =
      std::numeric_limits<double>::infinity();  ///< the reference's depth is within, metres
};

/// Errors of planar depth, over judged pixels where both images have a return.
struct DepthError {
  double p50 = 0.0, p99 = 0.0, max = 0.0;  ///< |test - reference|, metres (nearest rank)
  double abs_rel_p90 = 0.0;                ///< 90th percentile of |test - reference| / reference
  double missing = 0.0;                    ///< share of judged pixels where only one image has a return
  double excluded = 0.0;                   ///< share of all pixels that the mask leaves out
  std::size_t pixels = 0;                  ///< pixels judged
};

/// Compares two depth images [pixels] in metres; 0, negative and not finite: no return. Judged are the
/// pixels that `options` selects and `excluded` (empty, or one value a pixel) does not leave out; one
/// without a return in the reference has no range to be limited by.
/// Errors: invalid_argument where sizes disagree or are 0.
Result<DepthError> depth_error(Samples reference, Samples test, Samples reference_alpha,
                               std::span<const std::uint8_t> excluded = {},
                               const DepthErrorOptions& options = {});

}  // namespace gsnav::eval
