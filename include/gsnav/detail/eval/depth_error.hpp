// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/eval/samples.hpp"

namespace gsnav::eval {

/// Which pixels depth_error compares.
struct DepthErrorOptions {
  double min_alpha = 0.9;  ///< The alpha of the reference must be above this.
  double max_range = std::numeric_limits<double>::infinity();  ///< The depth of the reference must be at
                                                               ///< most this, metres.
};

/// Statistics of the error of planar depth. Errors are over compared pixels where both images have a
/// return.
struct DepthError {
  double p50 = 0.0, p99 = 0.0, max = 0.0;  ///< Percentiles (nearest rank) and maximum of |test -
                                           ///< reference|, metres.
  double abs_rel_p90 = 0.0;                ///< 90th percentile of |test - reference| / reference.
  double missing = 0.0;                    ///< Fraction of compared pixels where only one image has a
                                           ///< return.
  double excluded = 0.0;                   ///< Fraction of all pixels that the mask excludes.
  std::size_t pixels = 0;                  ///< Number of pixels compared.
};

/// Compares two depth images, shape [pixels], metres. A value that is 0, negative or not finite means no
/// return.
/// @param reference, test The depth images.
/// @param reference_alpha Alpha of the reference, shape [pixels].
/// @param excluded Shape [pixels] or empty. Pixels with a nonzero value are not compared.
/// @param options Further limits. Pixels without a return in the reference are not subject to
/// `max_range`.
/// @return invalid_argument if sizes disagree or are 0.
Result<DepthError> depth_error(Samples reference, Samples test, Samples reference_alpha,
                               std::span<const std::uint8_t> excluded = {},
                               const DepthErrorOptions& options = {});

}  // namespace gsnav::eval
