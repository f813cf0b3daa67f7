// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/frame/temporal.hpp"

namespace gsnav {

/// Checks that the lengths of all arrays agree.
/// @return invalid_argument naming the array.
inline Status validate(const TemporalView& in) {
  const std::size_t n = in.base.size();
  Status status;
  const auto sized = [&](const View<const float>& v, std::size_t want, const char* name) {
    if (status.ok() && v.size != want) {
      status = {Errc::invalid_argument, std::string("TemporalView.") + name + " has " +
                                            std::to_string(v.size) + " values where " +
                                            std::to_string(want) + " are needed"};
    }
  };
  for (std::size_t k = 0; k < 3; ++k) sized(in.base.shape.means[k], n, "base.means");
  sized(in.base.shape.opacities, n, "base.opacities");
  sized(in.times, n, "times");
  sized(in.sigmas, n, "sigmas");
  for (std::size_t k = 0; k < kMotionPlanes; ++k)
    sized(in.motion[k], in.motion[k / 3 * 3].empty() ? 0 : n, "motion");
  return status;
}

/// State of moving Gaussians at one moment, in a backend's memory. Reused for the next moment.
template <Backend B>
struct Moment {
  explicit Moment(B& backend)
      : means{Buffer<float, B>(backend), Buffer<float, B>(backend), Buffer<float, B>(backend)},
        opacities(backend),
        bounds(backend) {}

  Buffer<float, B> means[3];
  Buffer<float, B> opacities;
  Buffer<ChunkBounds, B> bounds;
  GaussianRows
      gaussians;  ///< set to render: shapes and colours of the base, means and opacities of the moment
};

/// Evaluates N moving Gaussians at time `t` in seconds. `out.gaussians` can be rendered like any other
/// set until the next call. Gaussians whose opacity falls below 1/255 get opacity 0 and are not drawn.
///
/// Arithmetic is in S; double is the reference. On host backends with sorted rows (`base.chunk_bounds`
/// is set), chunks get bounds for this moment; otherwise they have no bounds and none is culled. The
/// result is complete after `backend.synchronize()`.
/// @return invalid_argument naming the array, or for a time that is not finite.
template <class S, Backend B>
Status gaussians_at(B& backend, const TemporalView& in, double t, Moment<B>& out) {
  if (Status s = validate(in); !s) return s;
  if (!is_finite(t)) return {Errc::invalid_argument, "gaussians_at: the time is " + std::to_string(t)};
  const std::size_t n = in.base.size();
  GaussianAt<S> at{in.base.shape, in, t, {}, {}};
  out.gaussians = in.base;
  for (std::size_t k = 0; k < 3; ++k) {
    out.means[k].resize_discard(n);
    at.means[k] = out.means[k].view();
    out.gaussians.shape.means.set(k, {out.means[k].data(), n});
  }
  out.opacities.resize_discard(n);
  at.opacities = out.opacities.view();
  out.gaussians.shape.opacities = {out.opacities.data(), n};
  backend.parallel_for(n, at);
  out.gaussians.chunk_bounds = out.gaussians.part_bounds = {};
  if constexpr (is_host_backend<B>) {
    if (!in.base.chunk_bounds.empty()) {
      const std::size_t chunks = in.base.chunk_count();
      out.bounds.resize_discard(chunks);
      backend.parallel_for(chunks,
                           BoundChunkAt{out.gaussians.shape, in.base.origins, out.bounds.view()});
      out.gaussians.chunk_bounds = {out.bounds.data(), chunks};
    }
  }
  return {};
}

}  // namespace gsnav
