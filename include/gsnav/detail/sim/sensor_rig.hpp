// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/sensor_finish.hpp"
#include "gsnav/detail/sim/sensor_images.hpp"
#include "gsnav/detail/sim/sensor_plan.hpp"
#include "gsnav/detail/sim/sensor_requests.hpp"

namespace gsnav {

/// Sensors of one or more agents with the same set of sensors. Renders views: it turns them into
/// requests, renders these, and turns the frames into sensor images.
template <Backend B>
class SensorRig {
 public:
  /// Plans the views of `sensors`. Precondition: validate() accepts each of them.
  SensorRig(B& backend, std::vector<SensorSpec> sensors)
      : backend_(&backend),
        plan_(std::move(sensors)),
        requests_(backend),
        renderer_(backend),
        finish_(backend) {}

  /// Cameras and buffers of the sensors.
  const SensorPlan& plan() const noexcept { return plan_; }
  /// Checks that images of these sensors can stay in the memory of the backend.
  /// @return unsupported, with the sensor.
  static Status check_memory(std::span<const SensorSpec> sensors, ImageMemory memory) {
    if (memory == ImageMemory::host || is_host_backend<B>) return {};
    for (const SensorSpec& s : sensors) {
      const bool plain =
          s.kind == SensorKind::rgb || s.kind == SensorKind::depth || s.kind == SensorKind::alpha;
      if (BatchBackend<B> && plain && s.model == SensorModel::pinhole && s.noise.kind == NoiseKind::none)
        continue;
      return {Errc::unsupported,
              "SensorSpec \"" + s.uuid +
                  "\": images stay in a backend's memory where they are a "
                  "pinhole's colour, depth or alpha, without noise; use ImageMemory::host"};
    }
    return {};
  }
  /// Allocates images for `rows` views.
  void resize(SensorImages<B>& images, std::size_t rows) const { images.resize(*backend_, plan_, rows); }

  /// Renders all sensors of all views into their rows.
  /// @param idle Called before each wait for a batch (BasicRenderer::render).
  /// @return an error of rendering.
  Status render(std::span<const SensorView> views, SensorImages<B>& images,
                const std::function<void()>& idle = {}) {
    // Process a limited number of views at a time to keep scratch memory small.
    const std::size_t most = plan_.needs_scratch() ? kScratchViews : views.size();
    for (std::size_t first = 0; first < views.size(); first += most) {
      const auto some = views.subspan(first, std::min(most, views.size() - first));
      const auto requests = requests_.make(plan_, some, images);
      if (Status s = renderer_.render(requests, images.memory, idle); !s) return s;
      if (Status s = finish_.run(plan_, requests_, some, images); !s) return s;
    }
    return {};
  }
  /// Number of renders so far.
  std::size_t render_count() const noexcept { return requests_.render_count(); }
  /// Renderer that the sensors use.
  ImageRenderer<B>& renderer() noexcept { return renderer_; }

 private:
  static constexpr std::size_t kScratchViews = 16;

  B* backend_;
  SensorPlan plan_;
  SensorRequests<B> requests_;
  ImageRenderer<B> renderer_;
  SensorFinish<B> finish_;
};

}  // namespace gsnav
