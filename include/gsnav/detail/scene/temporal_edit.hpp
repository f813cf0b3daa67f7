// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/detail/scene/temporal_cloud.hpp"

namespace gsnav {

/// Gives a cloud without motion the planes of one: it never moves and is always present.
inline void stand_still(TemporalCloud& scene) {
  scene.times.assign(scene.size(), 0.0f);
  scene.sigmas.assign(scene.size(), std::numeric_limits<float>::infinity());
  for (auto& plane : scene.motion) plane.clear();
}

/// Sorts the rows in space by their means at their own times. A scene must be sorted only once, after
/// reading.
inline void sort_spatially(TemporalCloud& scene) {
  scene.cloud.row_ids.clear();
  PoolBackend backend(threads_for(scene.size()));
  sort_spatially(backend, scene.cloud);
  const std::vector<std::uint32_t>& order = scene.cloud.row_ids;
  permute_rows(backend, order, 1, scene.times);
  permute_rows(backend, order, 1, scene.sigmas);
  for (auto& plane : scene.motion) permute_rows(backend, order, 1, plane);
}

/// The scene at time `t` (seconds, finite) as a static cloud. Computed in double; Gaussians below 1/255
/// are left out. Not sorted.
inline GaussianCloud cloud_at(const TemporalCloud& scene, double t) {
  const TemporalView view = scene.view();
  GaussianCloud out = scene.cloud;
  detail::replace_means(out, [&](std::size_t i) {
    double opacity = 0;
    const Vec3d moved =
        scene.cloud.mean(i) + temporal_state<double>(view.base.shape, view, i, t, opacity);
    out.opacities[i] = static_cast<float>(opacity);
    return moved;
  });
  filter_rows(out, [&](std::size_t i) { return out.opacities[i] > 0; });
  return out;
}

}  // namespace gsnav
