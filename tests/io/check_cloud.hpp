// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/scene/gaussian_cloud.hpp"
#include "ply_file.hpp"

namespace gsnav_test {

/// Whether a and b agree to `relative`, or to 1e-7 where both are small.
inline bool near(long double a, long double b, long double relative = 3e-7L) {
  return std::fabs(a - b) <= relative * std::fabs(b) + 1e-7L;
}

/// Checks the SH bands above 0 of Gaussian i against the row it was read from by `same(got, want)`.
template <class Same>
void check_rest(const gsnav::GaussianCloud& c, std::size_t i, const PlyRow& row, int rest_in_file,
                const Same& same) {
  const int kept = (c.sh_degree + 1) * (c.sh_degree + 1) - 1;
  bool rest_ok = true;
  for (int coefficient = 0; coefficient < kept; ++coefficient) {
    for (int channel = 0; channel < 3; ++channel) {
      const double want = row.at("f_rest_" + std::to_string(channel * (rest_in_file / 3) + coefficient));
      const std::size_t at =
          i * 3 * static_cast<std::size_t>(kept) + static_cast<std::size_t>(3 * coefficient + channel);
      rest_ok = rest_ok && same(c.shN[at], want);
    }
  }
  CHECK(rest_ok);
}

/// Checks Gaussian i of a cloud against the row it was read from. `rest_in_file` is the number of
/// f_rest_* properties that the row has.
inline void check_gaussian(const gsnav::GaussianCloud& c, std::size_t i, const PlyRow& row,
                           int rest_in_file) {
  const ExpectedGaussian e(row);
  const gsnav::Vec3d mean = c.mean(i);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(near(mean[static_cast<int>(k)], e.mean[k]));
    CHECK(near(c.scales[k][i], e.scale[k]));
    CHECK(c.sh0[3 * i + k] == static_cast<float>(e.dc[k]));
  }
  for (std::size_t k = 0; k < 4; ++k) CHECK(near(c.quats[k][i], e.quat[k]));
  CHECK(near(c.opacities[i], e.opacity));
  check_rest(c, i, row, rest_in_file,
             [](float got, double want) { return got == static_cast<float>(want); });
}

/// A row as another program gives it: a PLY's fields.
struct KnownRow {
  double mean[3], log_scales[3], quat[4], opacity_logit, dc[3];
};

/// Checks Gaussian i against it, within float32's rounding.
inline void check_known(const gsnav::GaussianCloud& c, std::size_t i, const KnownRow& e) {
  const gsnav::Vec3d mean = c.mean(i);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(near(mean[static_cast<int>(k)], e.mean[k]));
    CHECK(near(c.scales[k][i], std::exp(e.log_scales[k]), 2e-6L));
    CHECK(near(c.sh0[3 * i + k], e.dc[k]));
  }
  for (std::size_t k = 0; k < 4; ++k) CHECK(near(c.quats[k][i], e.quat[k]));
  CHECK(near(c.opacities[i], 1 / (1 + std::exp(-e.opacity_logit))));
}

/// Checks that the arrays of a cloud belong together and that its report adds up.
inline void check_consistent(const gsnav::LoadedCloud& loaded) {
  const gsnav::GaussianCloud& c = loaded.cloud;
  const gsnav::LoadReport& r = loaded.report;
  CHECK(r.kept == c.size());
  CHECK(r.read == r.kept + r.dropped());
  CHECK(c.sh0.size() == 3 * c.size());
  const auto degree = static_cast<std::size_t>(c.sh_degree);
  CHECK(c.shN.size() == 3 * ((degree + 1) * (degree + 1) - 1) * c.size());
  for (const auto& axis : c.means) CHECK(axis.size() == c.size());
  for (const auto& axis : c.scales) CHECK(axis.size() == c.size());
  for (const auto& part : c.quats) CHECK(part.size() == c.size());
  bool finite = true;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const gsnav::Vec3d m = c.mean(i);
    finite = finite && std::isfinite(m.x) && std::isfinite(m.y) && std::isfinite(m.z) &&
             c.opacities[i] >= 0 && c.opacities[i] <= 1;
  }
  CHECK(finite);
}

/// Where the row that was read as number `row` lies after sort_spatially.
inline std::size_t place_of(const gsnav::GaussianCloud& cloud, std::size_t row) {
  const auto at = std::find(cloud.row_ids.begin(), cloud.row_ids.end(), static_cast<std::uint32_t>(row));
  REQUIRE(at != cloud.row_ids.end());
  return static_cast<std::size_t>(at - cloud.row_ids.begin());
}

}  // namespace gsnav_test
