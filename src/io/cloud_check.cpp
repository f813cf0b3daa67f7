// SPDX-License-Identifier: Apache-2.0
#include "cloud_check.hpp"

#include <string>

namespace gsnav::io::detail {

std::size_t rest_width(const GaussianCloud& cloud) noexcept {
  return 3 * static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree) - 1);
}

Status check_arrays(const std::filesystem::path& path, const GaussianCloud& c) {
  const std::size_t n = c.size();
  if (c.compact()) {
    return {Errc::invalid_argument,
            path.string() + ": the cloud is compact: expand_sh first, or save_scene"};
  }
  bool ok = c.sh_degree >= 0 && c.sh_degree <= kMaxShDegree && c.sh0.size() == 3 * n &&
            c.shN.size() == rest_width(c) * n && (c.origin_ids.empty() || c.origin_ids.size() == n);
  for (std::size_t k = 0; k < 3; ++k) ok = ok && c.means[k].size() == n && c.scales[k].size() == n;
  for (std::size_t k = 0; k < 4; ++k) ok = ok && c.quats[k].size() == n;
  for (const std::uint32_t id : c.origin_ids) ok = ok && id < c.origins.size();
  if (ok) return {};
  return {Errc::invalid_argument, path.string() + ": the cloud's arrays do not fit its size " +
                                      std::to_string(n) + " and SH degree " +
                                      std::to_string(c.sh_degree)};
}

}  // namespace gsnav::io::detail
