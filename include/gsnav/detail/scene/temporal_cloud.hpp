// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "gsnav/detail/render/at_time.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/renderer.hpp"

namespace gsnav {

/// Gaussians that move and fade in host memory (TemporalView has the formulas).
struct TemporalCloud {
  GaussianCloud cloud;        ///< each Gaussian at its own time
  std::vector<float> times;   ///< [N] seconds
  std::vector<float> sigmas;  ///< [N] seconds; infinity: always there
  std::array<std::vector<float>, kMotionPlanes>
      motion;  ///< x, y, z of velocity, acceleration, jerk; [N] or empty

  std::size_t size() const noexcept { return cloud.size(); }
  /// Bytes held by the arrays.
  std::size_t bytes() const noexcept {
    std::size_t values = times.size() + sigmas.size();
    for (const auto& plane : motion) values += plane.size();
    return cloud.bytes() + sizeof(float) * values;
  }
  /// What kernels read; valid while this lives and does not grow.
  TemporalView view() const noexcept {
    TemporalView v;
    v.base = cloud.view();
    v.times = view_of(times);
    v.sigmas = view_of(sigmas);
    for (std::size_t k = 0; k < kMotionPlanes; ++k) v.motion[k] = view_of(motion[k]);
    return v;
  }
};

/// Gives a cloud without motion the planes of one: it stands, always.
inline void stand_still(TemporalCloud& scene) {
  scene.times.assign(scene.size(), 0.0f);
  scene.sigmas.assign(scene.size(), std::numeric_limits<float>::infinity());
  for (auto& plane : scene.motion) plane.clear();
}

/// Sorts the rows in space by their means at their own times. A scene is sorted once, as it was read.
inline void sort_spatially(TemporalCloud& scene) {
  scene.cloud.row_ids.clear();
  PoolBackend backend(threads_for(scene.size()));
  sort_spatially(backend, scene.cloud);
  const std::vector<std::uint32_t>& order = scene.cloud.row_ids;
  permute_rows(backend, order, 1, scene.times);
  permute_rows(backend, order, 1, scene.sigmas);
  for (auto& plane : scene.motion) permute_rows(backend, order, 1, plane);
}

/// The scene at a finite time `t`, seconds, as a cloud that stands: computed in double, Gaussians below
/// 1/255 left out. Not sorted.
inline GaussianCloud cloud_at(const TemporalCloud& scene, double t) {
  const TemporalView view = scene.view();
  GaussianCloud out = scene.cloud, moved;
  MeanWriter writer;
  for (std::size_t i = 0; i < scene.size(); ++i) {
    double opacity = 0;
    writer.push(moved, scene.cloud.mean(i) + temporal_state<double>(view, i, t, opacity));
    out.opacities[i] = static_cast<float>(opacity);
  }
  out.means = std::move(moved.means);
  out.origin_ids = std::move(moved.origin_ids);
  out.origins = std::move(moved.origins);
  filter_rows(out, [&](std::size_t i) { return out.opacities[i] > 0; });
  return out;
}

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
