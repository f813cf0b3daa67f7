// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/detail/render/at_time.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"
#include "gsnav/scene/basic_renderer.hpp"

namespace gsnav {

/// A moving scene in a backend's memory, taken to one time after the other. On host backends the scene's
/// arrays are used as they are: it must outlive this, as must the backend.
template <Backend B>
class TemporalGaussians {
 public:
  TemporalGaussians(B& backend, const TemporalCloud& scene)
      : backend_(backend), arrays_(backend, scene.cloud), view_(scene.view()), moment_(backend) {
    view_.base = arrays_.set().gaussians;
    if constexpr (!is_host_backend<B>) {
      const auto to_device = [&](View<const float>& from) {
        held_.emplace_back(backend).upload(from.data, from.size);
        from = {held_.back().data(), from.size};
      };
      to_device(view_.times);
      to_device(view_.sigmas);
      for (auto& plane : view_.motion) to_device(plane);
    }
  }

  /// Errors: those of gaussians_at.
  Status set_time(double t) { return gaussians_at<float>(backend_, view_, t, moment_); }
  /// The scene as it is since the last set_time, which must have come first.
  GaussianSet set(const Similarity& world_from_asset = {}) const noexcept {
    GaussianSet s = arrays_.set(world_from_asset);
    s.gaussians = moment_.gaussians;
    return s;
  }

 private:
  B& backend_;
  GaussianArrays<B> arrays_;
  TemporalView view_;
  Moment<B> moment_;
  std::vector<Buffer<float, B>> held_;  // a Buffer's memory stays where it is when the vector grows
};

}  // namespace gsnav
