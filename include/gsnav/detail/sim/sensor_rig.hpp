// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/detail/sim/image_renderer.hpp"
#include "gsnav/detail/sim/sensor_finish.hpp"
#include "gsnav/detail/sim/sensor_images.hpp"
#include "gsnav/detail/sim/sensor_plan.hpp"
#include "gsnav/detail/sim/sensor_requests.hpp"

namespace gsnav {

/// The sensors of a body. Bodies with the same sensors are drawn together: views become requests, the
/// requests are drawn, and what was drawn becomes the sensors' images.
template <Backend B>
class SensorRig {
 public:
  /// `sensors` are valid.
  SensorRig(B& backend, std::vector<SensorSpec> sensors)
      : backend_(&backend),
        plan_(std::move(sensors)),
        requests_(backend),
        renderer_(backend),
        finish_(backend) {}

  const SensorPlan& plan() const noexcept { return plan_; }
  /// Whether images of such sensors can be left in a backend's memory. Errors: unsupported, naming the
  /// sensor.
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
  void resize(SensorImages<B>& images, std::size_t rows) const { images.resize(*backend_, plan_, rows); }

  /// Draws all sensors of all views into their rows. Errors: what rendering reports.
  Status render(std::span<const SensorView> views, SensorImages<B>& images) {
    // Scratch is for so many views at a time that it stays small.
    const std::size_t most = plan_.needs_scratch() ? kScratchViews : views.size();
    for (std::size_t first = 0; first < views.size(); first += most) {
      const auto some = views.subspan(first, std::min(most, views.size() - first));
      if (Status s = renderer_.render(requests_.make(plan_, some, images), images.memory); !s) return s;
      if (Status s = finish_.run(plan_, requests_, some, images); !s) return s;
    }
    return {};
  }
  std::size_t render_count() const noexcept { return requests_.render_count(); }
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
