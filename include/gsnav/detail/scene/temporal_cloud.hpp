// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "gsnav/detail/frame/temporal.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

/// Gaussians in host memory that move and fade over time (MotionRows has the formulas).
struct TemporalCloud {
  GaussianCloud cloud;        ///< Each Gaussian as it is at its own time.
  std::vector<float> times;   ///< [N] seconds.
  std::vector<float> sigmas;  ///< [N] standard deviations in time, seconds; infinity: always present.
  std::array<std::vector<float>, kMotionPlanes>
      motion;  ///< x, y, z of velocity, acceleration and jerk; [N] each, or empty.

  /// Number of Gaussians, N.
  std::size_t size() const noexcept { return cloud.size(); }
  /// Bytes of the arrays.
  std::size_t bytes() const noexcept {
    std::size_t values = times.size() + sigmas.size();
    for (const auto& plane : motion) values += plane.size();
    return cloud.bytes() + sizeof(float) * values;
  }
  /// Views for kernels. Valid while this object lives and does not grow.
  TemporalView view() const& noexcept {
    TemporalView v;
    v.base = cloud.view();
    v.times = view_of(times);
    v.sigmas = view_of(sigmas);
    for (std::size_t k = 0; k < kMotionPlanes; ++k) v.motion[k] = view_of(motion[k]);
    return v;
  }
  TemporalView view() const&& = delete;
};

}  // namespace gsnav
