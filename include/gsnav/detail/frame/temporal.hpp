// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/core/view.hpp"
#include "gsnav/detail/frame/row_bounds.hpp"
#include "gsnav/detail/frame/set_rows.hpp"
#include "gsnav/frame/gaussians.hpp"
#include "gsnav/frame/rules.hpp"
#include "gsnav/math/functions.hpp"

namespace gsnav {

/// Number of planes of motion: velocity, acceleration and jerk, three components each.
inline constexpr std::size_t kMotionPlanes = 9;

/// How N Gaussians move and fade over time (4D Gaussians, as in Habitat-GS). It owns nothing.
///
/// At time t, with dt = t - times[i], the mean is base + v dt + a dt^2 / 2 + j dt^3 / 6. The opacity is
/// base * exp(-dt^2 / (2 (sigma^2 + 1e-8))). Shapes, orientations and colours do not change.
struct MotionRows {
  View<const float> times;   ///< [N], seconds
  View<const float> sigmas;  ///< [N], seconds, >= 0; infinity: never fades
  /// x, y, z of velocity (m/s), acceleration (m/s^2) and jerk (m/s^3), [N] each. Empty planes are zero.
  /// The three planes of one quantity are either all present or all empty.
  View<const float> motion[kMotionPlanes];
};
static_assert(sizeof(void*) != 8 || sizeof(MotionRows) <= 256);

/// Gaussians that move and fade. In `base`, each has the mean and opacity of its own time.
struct TemporalView : MotionRows {
  GaussianRows base;
};
static_assert(sizeof(void*) != 8 || sizeof(TemporalView) <= 656);

/// Factor of the opacity `dt` seconds from the Gaussian's own time.
template <class S>
GSNAV_HD S temporal_weight(S dt, S sigma) noexcept {
  // The constant is -log2(e) / 2. The limit keeps dt^2 finite in float; the factor is 0 there anyway.
  const S rate = static_cast<S>(-0.72134752044448170368);
  const S limited = clamp(dt, S(-1e15), S(1e15));
  return exp2(rate * (limited * limited / fma(sigma, sigma, S(1e-8))));
}

/// Offset of a Gaussian from its base position after `dt` seconds, given its velocity, acceleration and
/// jerk.
template <class S>
GSNAV_HD Vec3<S> temporal_offset(const Vec3<S>& velocity, const Vec3<S>& acceleration,
                                 const Vec3<S>& jerk, S dt) noexcept {
  const Vec3<S> inner = fma(dt * S(1.0 / 3), jerk, acceleration);
  return dt * fma(dt * S(0.5), inner, velocity);
}

/// State of Gaussian i at time t: returns its offset from the base in metres, and its opacity. An
/// opacity below 1/255 becomes 0, and the offset is then 0 as well.
template <class S>
GSNAV_HD Vec3<S> temporal_state(const ShapeRows& base, const MotionRows& in, std::size_t i, double t,
                                S& opacity) noexcept {
  const S dt = static_cast<S>(t - static_cast<double>(in.times[i]));
  opacity = S(opacity_of(base, i)) * temporal_weight(dt, S(in.sigmas[i]));
  if (!(opacity >= S(kAlphaMin))) {
    opacity = S(0);
    return {};
  }
  Vec3<S> of[3]{};
  for (int k = 0; k < 3; ++k) {
    if (in.motion[3 * k].empty()) continue;
    of[k] = {S(in.motion[3 * k][i]), S(in.motion[3 * k + 1][i]), S(in.motion[3 * k + 2][i])};
  }
  return temporal_offset(of[0], of[1], of[2], dt);
}

/// Kernel that writes the mean (offset from its origin) and the opacity of Gaussian i at time t.
template <class S>
struct GaussianAt {
  ShapeRows base;
  MotionRows in;
  double t = 0;
  View<float> means[3];
  View<float> opacities;

  GSNAV_HD void operator()(std::size_t i) const noexcept {
    S opacity;
    const Vec3<S> offset = temporal_state<S>(base, in, i, t, opacity);
    const Vec3<S> mean = vec_cast<S>(mean_of(base, i)) + offset;
    for (int k = 0; k < 3; ++k) means[k][i] = static_cast<float>(mean[k]);
    opacities[i] = static_cast<float>(opacity);
  }
};

/// Kernel that computes the bounds of chunk c from the results of GaussianAt. Gaussians with opacity 0
/// are ignored.
struct BoundChunkAt {
  ShapeRows rows;
  View<const Vec3d> origins;
  View<ChunkBounds> bounds;

  GSNAV_HD void operator()(std::size_t c) const noexcept {
    const std::size_t begin = c * kProjectChunk;
    const std::size_t end = begin + kProjectChunk < rows.size ? begin + kProjectChunk : rows.size;
    RowBounds all;
    for (std::size_t i = begin; i < end; ++i) {
      const float opacity = opacity_of(rows, i);
      if (!(opacity > 0)) continue;
      const Vec3d origin = origin_of(rows.origin_ids, origins, i),
                  mean = vec_cast<double>(mean_of(rows, i));
      // Culling assumes offsets within the lattice; these may be larger.
      const Vec3d pad{1e-6 * abs(mean.x), 1e-6 * abs(mean.y), 1e-6 * abs(mean.z)};
      all.add(origin + mean, pad, scales_of(rows, i), opacity);
    }
    bounds[c] = all.bounds();
  }
};

}  // namespace gsnav
