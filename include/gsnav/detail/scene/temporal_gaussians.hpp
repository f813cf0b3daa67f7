// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/detail/core/move_to.hpp"
#include "gsnav/detail/render/at_time.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav {

/// A moving scene in a backend's memory, evaluated at one time after another. On host backends the
/// scene's arrays are used in place. The scene and the backend must outlive this object; a temporary
/// scene does not compile on any backend.
template <Backend B>
class TemporalGaussians {
 public:
  /// Views the scene on host backends, copies it to others.
  TemporalGaussians(B& backend, const TemporalCloud& scene)
      : backend_(backend), arrays_(backend, scene.cloud), view_(scene.view()), moment_(backend) {
    view_.base = arrays_.set().gaussians;
    if constexpr (!is_host_backend<B>) {
      detail::move_to(backend, view_.times, held_);
      detail::move_to(backend, view_.sigmas, held_);
      for (auto& plane : view_.motion) detail::move_to(backend, plane, held_);
    }
  }
  TemporalGaussians(B& backend, const TemporalCloud&& scene) = delete;

  /// Evaluates the scene at time t, seconds. Errors: those of gaussians_at.
  Status set_time(double t) { return gaussians_at<float>(backend_, view_, t, moment_); }
  /// The scene as of the last set_time, which must have been called before.
  GaussianSet set(const Similarity& world_from_asset = {}) const& noexcept {
    GaussianSet s = arrays_.set(world_from_asset);
    s.gaussians = moment_.gaussians;
    return s;
  }
  GaussianSet set(const Similarity& world_from_asset = {}) const&& = delete;

 private:
  B& backend_;
  GaussianArrays<B> arrays_;
  TemporalView view_;
  Moment<B> moment_;
  std::vector<Buffer<float, B>> held_;
};

}  // namespace gsnav
