// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/frame/cut_depth.hpp"
#include "gsnav/detail/sim/mesh_normals.hpp"
#include "gsnav/detail/sim/sensor_requests.hpp"

namespace gsnav {

/// Turns rendered frames into sensor images: normals, resampling of cubes, the far plane of depth,
/// noise, and semantic labels.
template <Backend B>
class SensorFinish {
 public:
  explicit SensorFinish(B& backend) : backend_(&backend), normals_(backend) {}

  /// Processes frames that were rendered for `requests`, which were made from `plan` and `views`.
  /// @return the errors of draw_meshes.
  Status run(const SensorPlan& plan, const SensorRequests<B>& requests,
             std::span<const SensorView> views, SensorImages<B>& images) {
    if (!images.in_host_memory()) return cut_on_backend(plan, views, images);
    for (const auto& n : requests.normals()) {
      const SensorPlan::Group& group = plan.groups()[n.group];
      const SensorView& view = views[n.view];
      if (Status s = normals_.draw(view.meshes, requests.camera(n.camera), n.seen,
                                   plan.sensors()[group.sensor].far_plane,
                                   images.row(plan, group.buffer[SensorPlan::kNormal], view.row));
          !s) {
        return s;
      }
    }
    for_each_on_host(*backend_, views.size(), [&](std::size_t v) {
      sample_and_limit(plan, requests, v, views[v].row, images);
      add_noise(plan, views[v], images);
    });
    for (const auto& s : requests.shares()) {
      label_pixels(s.images, views[s.view].things(), images.row(plan, s.buffer, views[s.view].row));
    }
    return {};
  }

 private:
  /// Applies the far plane to depth images in the backend's memory. Only pinhole sensors are supported
  /// there.
  Status cut_on_backend(const SensorPlan& plan, std::span<const SensorView> views,
                        SensorImages<B>& images) {
    rows_.clear();
    for (const SensorView& v : views) rows_.push_back(v.row);
    std::sort(rows_.begin(), rows_.end());
    for (const SensorPlan::Group& group : plan.groups()) {
      if (!group.has(SensorPlan::kDepth)) continue;
      const std::size_t buffer = group.buffer[SensorPlan::kDepth];
      for (std::size_t begin = 0, end = 0; begin < rows_.size(); begin = end) {
        for (end = begin + 1; end < rows_.size() && rows_[end] == rows_[begin] + (end - begin);) ++end;
        backend_->parallel_for((end - begin) * plan.size(buffer),
                               CutDepth(images.row(plan, buffer, rows_[begin]).data(),
                                        plan.sensors()[group.sensor].far_plane));
      }
    }
    return backend_->synchronize();
  }

  static void sample_and_limit(const SensorPlan& plan, const SensorRequests<B>& requests,
                               std::size_t view, std::size_t row, SensorImages<B>& images) {
    for (std::size_t g = 0; g < plan.groups().size(); ++g) {
      const SensorPlan::Group& group = plan.groups()[g];
      for (std::size_t k = 0; k < SensorPlan::kSemantic; ++k) {
        if (!group.has(k)) continue;
        const std::span<float> out = images.row(plan, group.buffer[k], row);
        const bool depth = k == SensorPlan::kDepth;
        if (group.cube != nullptr) {
          const auto faces = requests.faces(plan, g, k, view);
          if (depth) {
            group.cube->sample_depth(faces, out);
          } else {
            group.cube->sample_color(faces, SensorPlan::channels(k), out);
          }
        }
        if (!depth) continue;
        const CutDepth cut(out.data(), plan.sensors()[group.sensor].far_plane);
        for (std::size_t i = 0; i < out.size(); ++i) cut(i);
      }
    }
  }

  static void add_noise(const SensorPlan& plan, const SensorView& view, SensorImages<B>& images) {
    for (std::size_t i = 0; i < plan.sensors().size(); ++i) {
      const SensorSpec& sensor = plan.sensors()[i];
      if (sensor.noise.kind == NoiseKind::none) continue;
      const std::span<const float> clean = images.row(plan, plan.buffers_of(i).clean, view.row);
      const std::span<float> out = images.row(plan, plan.buffers_of(i).noisy, view.row);
      // Seeds that differ by one step of the generator would give the same stream, shifted. Hash them.
      const std::uint64_t seed = Rng(view.noise + 0xd6e8feb86659fd93ull * (i + 1)).next();
      if (sensor.noise.kind == NoiseKind::redwood_depth) {
        redwood_depth(sensor.noise, seed, sensor.resolution[0], sensor.resolution[1], clean, out);
      } else {
        std::copy(clean.begin(), clean.end(), out.begin());
        add_color_noise(sensor.noise, seed, out);
      }
    }
  }

  B* backend_;
  MeshNormals<B> normals_;
  std::vector<std::size_t> rows_;
};

}  // namespace gsnav
