// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/render/render_config.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

struct SimulatorConfig {
  TaskConfig task{};
  std::vector<SensorSpec> sensors;  ///< none: nothing is rendered
  RenderConfig render{};            ///< outputs and sort order are chosen by sensors and scene
  /// Draws the assets by levels of detail: the profile lod (docs/lod.md), whatever render.profile is.
  /// Each needs its tree (SceneAsset::lod). No hysteresis: an image depends on its camera, not on what
  /// was seen before.
  std::optional<LodChoice> lod{};
  /// Draws of the assets only what is seen from where a camera is, by the rules of the profile fast
  /// (VisibleSets). Each needs its sets (SceneAsset::visible); from where these know nothing, all is
  /// drawn.
  bool visible_sets = false;
  bool rendering = true;   ///< off: physics and metrics only, no image memory
  std::uint64_t seed = 0;  ///< of the sensors' noise
};

/// What of its assets a simulator draws.
inline DetailChoice detail_choice(const SimulatorConfig& config) {
  return {config.lod, config.visible_sets};
}

/// invalid_argument, naming the field, where a value is impossible.
inline Status validate(const SimulatorConfig& config) {
  if (Status s = validate(config.task); !s) return s;
  if (Status s = validate(config.render); !s) return s;
  return validate(std::span<const SensorSpec>(config.sensors));
}

/// Where images are.
enum class ImageMemory : std::uint8_t {
  host,
  backend,  ///< in the backend's own, a GPU's say; on host backends the same
};

struct BatchConfig : SimulatorConfig {
  AutoReset auto_reset = AutoReset::next_step;
  /// Times of a scene for which its avatars are held posed at once; more are drawn one after the other.
  /// Memory grows with it.
  std::size_t pose_slots = 8;
  /// `backend` leaves images on the GPU that drew them: colour, depth and alpha of pinholes, without
  /// noise.
  ImageMemory images = ImageMemory::host;
};

}  // namespace gsnav
