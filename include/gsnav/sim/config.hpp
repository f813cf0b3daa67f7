// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
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
  /// Agent, actions and rules of the task.
  TaskConfig task{};
  /// Sensors of the agent. Default: an RGB and a depth sensor ("rgb", "depth") of 256 x 256 pixels and
  /// 90 degrees, 1.5 m above the ground. Empty: nothing is rendered.
  std::vector<SensorSpec> sensors = rgbd_sensors();
  /// How sensors render. Leave `outputs` at its default, because the sensors determine it. `sort_order`
  /// comes from the first asset of the scene; any value other than the default or that one is an error.
  RenderConfig render{};
  /// Render the assets at a level of detail that depends on the distance (profile `lod`,
  /// docs/concepts/scene.md). Implies Exponential::fast. Every asset needs a tree (SceneAsset::lod),
  /// unless LodChoice::bodies_only is set. There is no hysteresis: an image depends only on its camera.
  std::optional<LodChoice> lod{};
  /// Render only the Gaussians that are visible from the camera's cell (VisibleSets), with the rules of
  /// the profile `fast`. Every asset needs visible sets (SceneAsset::visible). From positions outside
  /// all cells, everything is drawn.
  bool visible_sets = false;
  bool rendering = true;   ///< False: simulate without rendering and without memory for images.
  std::uint64_t seed = 0;  ///< Seed of the sensor noise.
};

/// Settings for levels of detail and visible sets. They decide which Gaussians a simulator draws.
inline DetailChoice detail_choice(const SimulatorConfig& config) {
  return {config.lod, config.visible_sets};
}

/// Checks the values of a configuration.
/// @return invalid_argument, with the field that is out of range.
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

/// Checks that a simulator with `config` can run in `scene`.
/// @return invalid_argument, with the missing part of the scene or the contradicting field.
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

/// Memory in which images are returned.
enum class ImageMemory : std::uint8_t {
  /// Host memory.
  host,
  backend,  ///< Memory of the backend, for example of a GPU. Host backends treat it like `host`.
};

namespace detail {

/// The image of sensor `uuid`, or null.
template <class Image>
const Image* find_image(std::span<const Image> images, std::string_view uuid) noexcept {
  for (const Image& i : images) {
    if (i.uuid == uuid) return &i;
  }
  return nullptr;
}
/// The image of sensor `uuid`. Throws gsnav::Error, with the names that exist, if there is none.
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

/// Gives memory for the images of one sensor.
/// @param sensor Index in SimulatorConfig::sensors.
/// @param floats Size of the images of all environments, [N][height][width][channels].
/// @return memory of at least that size, aligned as a float is; or an error, which the batch returns.
using ImageSource = std::function<Result<std::span<float>>(std::size_t sensor, std::size_t floats)>;

/// Settings of a batch of environments.
struct BatchConfig : SimulatorConfig {
  /// When an environment that is done begins its next episode.
  AutoReset auto_reset = AutoReset::next_step;
  /// Number of poses of each scene's avatars that are held at once, >= 1. If environments in one scene
  /// need more distinct times, they are rendered in several passes. Memory grows with it.
  std::size_t pose_slots = 8;
  /// Where images are returned. ImageMemory::backend leaves them on the GPU. It supports RGB, depth and
  /// alpha of pinhole cameras without noise.
  ImageMemory images = ImageMemory::host;
  /// Chooses where each call draws BatchStep::images. It is called for each sensor before any
  /// environment moves. The memory is of the kind in `images`. The batch does not use it after the call,
  /// so it may be kept, changed or freed. Therefore reset(mask) also draws the environments that it
  /// leaves alone. Sensors of one kind on one camera share memory, asked for once. Null: the batch draws
  /// into memory of its own, which its next call overwrites.
  ImageSource image_source{};
};

/// Image of one sensor. Valid until the next reset(), step() or observe() of its simulator.
struct Observation {
  /// Sensor name from SensorSpec::uuid.
  std::string_view uuid;
  /// Kind of the image.
  SensorKind kind = SensorKind::rgb;
  /// Image size in pixels, and number of channels.
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;  ///< Shape [height][width][channels], top row first.
};

/// Result of a reset or an action: images, goal, and outcome of the action.
struct Observations : StepInfo {
  std::span<const Observation> images;  ///< Images in the order of the sensors. Empty if nothing was
                                        ///< rendered.
  /// Goal as seen from the agent.
  PointGoal point_goal{};
  double time = 0.0;  ///< Time on the scene's clock, seconds.

  /// The image of sensor `uuid`, shape [height][width][channels].
  /// Throws gsnav::Error (aborts under -fno-exceptions) if there is no such image. The message lists the
  /// sensors, or says that nothing was rendered.
  std::span<const float> operator[](std::string_view uuid) const {
    return detail::image_named(images, uuid).data;
  }
  /// The image of sensor `uuid` with its size, or null if there is none.
  const Observation* find(std::string_view uuid) const noexcept {
    return detail::find_image(images, uuid);
  }
};

/// Images of one sensor for all environments, shape [environments][height][width][channels]. Valid until
/// the next call of the simulator, unless BatchConfig::image_source gave the memory. interop/dlpack.hpp
/// wraps them as tensors.
struct BatchObservation {
  /// Sensor name from SensorSpec::uuid.
  std::string_view uuid;
  /// Kind of the image.
  SensorKind kind = SensorKind::rgb;
  /// Number of images.
  std::size_t environments = 0;
  /// Image size in pixels, and number of channels.
  int height = 0, width = 0, channels = 0;
  std::span<const float> data;  ///< Pixels in host memory. Empty if images stay in the backend's memory.
  const float* on_backend = nullptr;  ///< Pixels in the backend's memory (BatchConfig::images), or null.
                                      ///< Rendering has finished when the call returns.

  /// The image of one environment in host memory. In `final_images`, `environment` is the index in
  /// BatchStep::finished.
  std::span<const float> of(std::size_t environment) const noexcept {
    const std::size_t n = data.size() / environments;
    return data.subspan(environment * n, n);
  }
};

/// Result of a batch step, in the form of Gymnasium's VectorEnv: observations, rewards, terminated,
/// truncated and further information.
struct BatchStep : BatchInfo {
  std::span<const BatchObservation> images;  ///< Images in the order of the sensors. Empty if nothing
                                             ///< was rendered.
  /// Last images of the episodes that ended in this step, one row per entry of `finished`. Filled only
  /// with AutoReset::same_step.
  std::span<const BatchObservation> final_images;

  /// The images of sensor `uuid`. Throws gsnav::Error like Observations::operator[].
  const BatchObservation& operator[](std::string_view uuid) const {
    return detail::image_named(images, uuid);
  }
  /// The images of sensor `uuid`, or null if there are none.
  const BatchObservation* find(std::string_view uuid) const noexcept {
    return detail::find_image(images, uuid);
  }
};

/// Work of the caller during a call of a batch. The function is called once, after the environments have
/// moved, and while a GPU draws the images, so that the work takes no time of its own. Backends that
/// draw one image after the other call it when the images are complete. If the environments cannot move,
/// it is not called.
/// @param step Result of the call. On a GPU, only the pixels of `images` are not written yet.
/// @return an error, which the call returns when the images are complete. The batch needs no reset after
/// it. The function must not call the batch, and must leave the current GPU as it was.
using WhileDrawing = std::function<Status(const BatchStep& step)>;

}  // namespace gsnav
