// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/eval/depth_error.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "statistics.hpp"

namespace gsnav::eval {

Result<DepthError> depth_error(Samples reference, Samples test, Samples reference_alpha,
                               std::span<const std::uint8_t> excluded,
                               const DepthErrorOptions& options) {
  const std::size_t n = reference.size();
  if (n == 0 || test.size() != n || reference_alpha.size() != n ||
      (!excluded.empty() && excluded.size() != n)) {
    return {Errc::invalid_argument, std::string("depth_error: ") + std::to_string(n) + " and " +
                                        std::to_string(test.size()) + " depths, " +
                                        std::to_string(reference_alpha.size()) + " alphas, a mask of " +
                                        std::to_string(excluded.size())};
  }
  const auto returns = [](double depth) { return depth > 0.0 && std::isfinite(depth); };
  std::vector<double> errors, relative;
  std::size_t masked = 0, mismatched = 0;
  DepthError out;
  for (std::size_t p = 0; p < n; ++p) {
    if (!excluded.empty() && excluded[p] != 0) {
      ++masked;
      continue;
    }
    const double z = reference[p], t = test[p];
    const bool hit = returns(z);
    if (!(reference_alpha[p] > options.min_alpha) || (hit && z > options.max_range)) continue;
    ++out.pixels;
    if (hit != returns(t)) {
      ++mismatched;
    } else if (hit) {
      errors.push_back(std::fabs(t - z));
      relative.push_back(std::fabs(t - z) / z);
    }
  }
  out.p50 = detail::percentile(errors, 0.5);
  out.p99 = detail::percentile(errors, 0.99);
  out.max = detail::percentile(errors, 1.0);
  out.abs_rel_p90 = detail::percentile(relative, 0.9);
  out.missing = detail::share(mismatched, out.pixels);
  out.excluded = detail::share(masked, n);
  return out;
}

}  // namespace gsnav::eval
