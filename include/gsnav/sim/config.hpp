// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/batch_world.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/detail/sim/task.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/sim/scene.hpp"
#include "gsnav/sim/world.hpp"

namespace gsnav {

/// Settings of a simulator.
struct SimulatorConfig {
  TaskConfig task{};  ///< Rules of the episode: actions, body, success and time.
  /// An RGB and a depth sensor ("rgb", "depth") of 256 x 256 pixels and 90 degrees, 1.5 m above the
  /// ground, unless others are given. Empty: nothing is rendered.
  std::vector<SensorSpec> sensors = rgbd_sensors();
  /// How sensors draw. They choose `outputs`, and the scene's first asset chooses `sort_order`: a value
  /// that is neither the default nor theirs is an error.
  RenderConfig render{};
  /// Draws the assets by levels of detail: the profile lod (docs/concepts/scene.md), with
  /// Exponential::fast whatever render.quality has. Each needs its tree (SceneAsset::lod). No
  /// hysteresis: an image depends on its camera, not on what was seen before.
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
  if (config.render.outputs != RenderConfig{}.outputs) {
    return {Errc::invalid_argument,
            "SimulatorConfig.render.outputs = " + std::to_string(config.render.outputs) +
                ": sensors choose the images; leave the default"};
  }
  return validate(std::span<const SensorSpec>(config.sensors));
}

/// Whether a simulator may run in `scene` so: what of it is missing, or what of `config` it contradicts.
inline Status validate(const SimulatorScene& scene, const SimulatorConfig& config) {
  if (Status s = validate(scene); !s) return s;
  const SortOrder asked = config.render.sort_order;
  if (asked != SortOrder::z_depth && !scene.assets.empty() &&
      asked != scene.assets.front().sort_order()) {
    return {
        Errc::invalid_argument,
        "SimulatorConfig.render.sort_order: SimulatorScene.assets[0] has another; leave the default"};
  }
  return validate_detail(scene, detail_choice(config));
}

/// Where images are.
enum class ImageMemory : std::uint8_t {
  host,
  backend,  ///< in the backend's own, a GPU's say; on host backends the same
};

namespace detail {

/// The image with this uuid, or null.
template <class Image>
const Image* find_image(std::span<const Image> images, std::string_view uuid) noexcept {
  for (const Image& i : images) {
    if (i.uuid == uuid) return &i;
  }
  return nullptr;
}
/// The same; throws gsnav::Error naming the images that there are.
template <class Image>
const Image& image_named(std::span<const Image> images, std::string_view uuid) {
  if (const Image* const found = find_image(images, uuid)) return *found;
  std::string there;
  for (const Image& i : images) there.append(there.empty() ? "" : ", ").append(i.uuid);
  fail(
      Errc::invalid_argument,
      "no image of a sensor \"" + printable(uuid) + "\": " +
          (there.empty() ? "nothing was rendered (SimulatorConfig.sensors is empty, or rendering is off)"
                         : "the sensors are " + printable(there)));
}

}  // namespace detail

/// Settings of a batch of simulators.
struct BatchConfig : SimulatorConfig {
  AutoReset auto_reset = AutoReset::next_step;  ///< What happens when an episode ends.
  /// Times of a scene for which its avatars are held posed at once; more are drawn one after the other.
  /// Memory grows with it.
  std::size_t pose_slots = 8;
  /// `backend` leaves images on the GPU that drew them: colour, depth and alpha of pinholes, without
  /// noise.
  ImageMemory images = ImageMemory::host;
};

/// One sensor's image. Valid until the next step or reset of its simulator.
struct Observation {
  std::string_view uuid;                    ///< Sensor name from SensorSpec::uuid.
  SensorKind kind = SensorKind::rgb;        ///< What the sensor measures.
  int height = 0, width = 0, channels = 0;  ///< Size of the image.
  std::span<const float> data;              ///< [H][W][channels], row 0 on top
};

/// What the agent perceives after a reset or an action, and what that action did.
struct Observations : StepInfo {
  std::span<const Observation> images;  ///< in the sensors' order; empty without rendering
  PointGoal point_goal{};               ///< The goal as seen from the agent.
  double time = 0.0;                    ///< seconds on the scene's clock

  /// The image of sensor `uuid`, [H][W][channels]. Throws gsnav::Error (aborts under -fno-exceptions)
  /// where there is no image of that name: it lists the sensors, or says that nothing was rendered.
  std::span<const float> operator[](std::string_view uuid) const {
    return detail::image_named(images, uuid).data;
  }
  /// The same with its size, or null where there is no image of that name.
  const Observation* find(std::string_view uuid) const noexcept {
    return detail::find_image(images, uuid);
  }
};

/// One sensor's images of all environments, [environments][height][width][channels]. Valid until the
/// next call. interop/dlpack.hpp makes tensors of them, wherever they are.
struct BatchObservation {
  std::string_view uuid;                    ///< Sensor name from SensorSpec::uuid.
  SensorKind kind = SensorKind::rgb;        ///< What the sensor measures.
  std::size_t environments = 0;             ///< Number of environments.
  int height = 0, width = 0, channels = 0;  ///< Size of the image.
  std::span<const float> data;              ///< in host memory; empty where images stay in the backend's
  const float* on_backend =
      nullptr;  ///< there (BatchConfig::images), whole when the call that drew them returns

  /// The image, in host memory, of one environment (of a finished one: by its place in
  /// BatchStep::finished).
  std::span<const float> of(std::size_t environment) const noexcept {
    const std::size_t n = data.size() / environments;
    return data.subspan(environment * n, n);
  }
};

/// What Gymnasium's VectorEnv returns: observations, rewards, terminated, truncated and what else there
/// is to know.
struct BatchStep : BatchInfo {
  std::span<const BatchObservation> images;  ///< in the sensors' order; empty without rendering
  /// The last images of episodes that ended in this step and whose environments were reset in it, a row
  /// for each of `finished`; only with AutoReset::same_step.
  std::span<const BatchObservation> final_images;

  /// The images of sensor `uuid`. Throws and finds as Observations does.
  const BatchObservation& operator[](std::string_view uuid) const {
    return detail::image_named(images, uuid);
  }
  /// Images of one sensor, or null if there is none of this name.
  const BatchObservation* find(std::string_view uuid) const noexcept {
    return detail::find_image(images, uuid);
  }
};

}  // namespace gsnav
