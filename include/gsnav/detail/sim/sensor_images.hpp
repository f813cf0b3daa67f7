// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/buffer.hpp"
#include "gsnav/detail/core/guarded.hpp"
#include "gsnav/detail/core/host_array.hpp"
#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/sensor_plan.hpp"
#include "gsnav/sim/config.hpp"

namespace gsnav {

/// Images of all sensors of a plan, with one row per view.
template <Backend B>
struct SensorImages {
  ImageMemory memory = ImageMemory::host;
  std::size_t rows = 0;
  std::vector<HostArray<float, B>> buffers;
  std::vector<Buffer<float, B>> on_backend;  // Replaces `buffers` if images are not in host memory.
  std::vector<float*> given;  // For each buffer: memory of the caller, which replaces it, or null.

  bool in_host_memory() const noexcept { return is_host_backend<B> || memory == ImageMemory::host; }

  void resize(B& backend, const SensorPlan& plan, std::size_t count) {
    rows = count;
    given.resize(plan.buffers());
    const auto size = [&](std::size_t b) { return given[b] == nullptr ? rows * plan.size(b) : 0; };
    if (!in_host_memory()) {
      while (on_backend.size() < plan.buffers()) on_backend.emplace_back(backend);
      for (std::size_t b = 0; b < plan.buffers(); ++b) on_backend[b].resize_discard(size(b));
      return;
    }
    buffers.resize(plan.buffers());
    for (std::size_t b = 0; b < plan.buffers(); ++b) buffers[b].resize(size(b));
  }
  /// Asks `source` for memory for the next images of `count` views, as BatchConfig::image_source says.
  /// @return the error of `source`; invalid_argument, with the sensor, for memory that does not fit.
  Status ask(const SensorPlan& plan, std::size_t count, const ImageSource& source) {
    const auto bad = [](const std::string& what) {
      return Status(Errc::invalid_argument, "BatchConfig.image_source: " + what);
    };
    given.assign(plan.buffers(), nullptr);
    for (std::size_t i = 0; i < plan.sensors().size(); ++i) {
      const std::size_t buffer = plan.buffers_of(i).noisy, floats = count * plan.size(buffer);
      if (given[buffer] != nullptr) continue;
      const auto made = detail::guarded([&] { return source(i, floats); });
      if (!made) return made.status();
      const std::string sensor = "the sensor \"" + plan.sensors()[i].uuid + "\"";
      const std::size_t there = made->data() == nullptr ? 0 : made->size();
      if (there < floats) {
        return bad(std::to_string(there) + " floats for " + sensor + ", which needs " +
                   std::to_string(floats));
      }
      if (reinterpret_cast<std::uintptr_t>(made->data()) % alignof(float) != 0) {
        return bad("the memory for " + sensor + " is not aligned to " + std::to_string(alignof(float)) +
                   " bytes");
      }
      given[buffer] = made->data();
    }
    return {};
  }
  /// One row of a buffer, in whichever memory it is.
  std::span<float> row(const SensorPlan& plan, std::size_t buffer, std::size_t r) noexcept {
    return {first(buffer) + r * plan.size(buffer), plan.size(buffer)};
  }
  /// Image of a sensor in one row, shape [height][width][channels]. Host memory only.
  std::span<const float> image(const SensorPlan& plan, std::size_t sensor,
                               std::size_t r) const noexcept {
    const std::size_t buffer = plan.buffers_of(sensor).noisy, n = plan.size(buffer);
    return {first(buffer) + r * n, n};
  }
  /// All rows of a sensor, shape [rows][height][width][channels]. Empty if they are not in host memory.
  std::span<const float> all(const SensorPlan& plan, std::size_t sensor) const noexcept {
    if (!in_host_memory()) return {};
    const std::size_t buffer = plan.buffers_of(sensor).noisy;
    return {first(buffer), rows * plan.size(buffer)};
  }
  /// All rows of a sensor in the backend's memory. Null if they are in host memory.
  const float* all_on_backend(const SensorPlan& plan, std::size_t sensor) const noexcept {
    return in_host_memory() ? nullptr : first(plan.buffers_of(sensor).noisy);
  }

 private:
  const float* first(std::size_t buffer) const noexcept {
    if (given[buffer] != nullptr) return given[buffer];
    return in_host_memory() ? buffers[buffer].data() : on_backend[buffer].data();
  }
  float* first(std::size_t buffer) noexcept {
    return const_cast<float*>(std::as_const(*this).first(buffer));
  }
};

}  // namespace gsnav
