// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/sensor_plan.hpp"

namespace gsnav {

/// Images of all sensors of a plan, with one row per view.
template <Backend B>
struct SensorImages {
  ImageMemory memory = ImageMemory::host;
  std::size_t rows = 0;
  std::vector<HostArray<float, B>> buffers;
  std::vector<Buffer<float, B>> on_backend;  // Replaces `buffers` if images are not in host memory.

  bool in_host_memory() const noexcept { return is_host_backend<B> || memory == ImageMemory::host; }

  void resize(B& backend, const SensorPlan& plan, std::size_t count) {
    rows = count;
    if (!in_host_memory()) {
      while (on_backend.size() < plan.buffers()) on_backend.emplace_back(backend);
      for (std::size_t b = 0; b < plan.buffers(); ++b) on_backend[b].resize_discard(rows * plan.size(b));
      return;
    }
    buffers.resize(plan.buffers());
    for (std::size_t b = 0; b < plan.buffers(); ++b) buffers[b].resize(rows * plan.size(b));
  }
  /// One row of a buffer, in whichever memory it is.
  std::span<float> row(const SensorPlan& plan, std::size_t buffer, std::size_t r) noexcept {
    float* const first = in_host_memory() ? buffers[buffer].data() : on_backend[buffer].data();
    return {first + r * plan.size(buffer), plan.size(buffer)};
  }
  /// Image of a sensor in one row, shape [height][width][channels]. Host memory only.
  std::span<const float> image(const SensorPlan& plan, std::size_t sensor,
                               std::size_t r) const noexcept {
    const std::size_t buffer = plan.output(sensor).noisy, n = plan.size(buffer);
    return {buffers[buffer].data() + r * n, n};
  }
  /// All rows of a sensor, shape [rows][height][width][channels]. Empty if they are not in host memory.
  std::span<const float> all(const SensorPlan& plan, std::size_t sensor) const noexcept {
    if (!in_host_memory()) return {};
    const HostArray<float, B>& buffer = buffers[plan.output(sensor).noisy];
    return {buffer.data(), buffer.size()};
  }
  /// All rows of a sensor in the backend's memory. Null if they are in host memory.
  const float* all_on_backend(const SensorPlan& plan, std::size_t sensor) const noexcept {
    return in_host_memory() ? nullptr : on_backend[plan.output(sensor).clean].data();
  }
};

}  // namespace gsnav
