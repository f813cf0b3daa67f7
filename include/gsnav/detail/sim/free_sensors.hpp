// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/cube_map.hpp"
#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/render/frames.hpp"

namespace gsnav {

/// Pose of a sensor in the world.
struct SensorPose {
  Vec3d position{};  ///< World position, metres.
  Quatd rotation{};  ///< Orientation of the sensor: x right, y up, looking along -z. Unit length.
};

/// Sensors that are not fixed to an agent: each is anywhere at each call. SensorRig, by contrast, has
/// one agent that carries all sensors. Images have the bits of a SensorRig at the same poses.
class FreeSensors {
 public:
  /// Renders cameras of one image size. The frames have colour, alpha and median depth.
  using Render = std::function<Status(std::span<const Camera>, Frames<float>&)>;

  /// Prepares sensors. Their fields `position` and `orientation` are ignored.
  /// @return invalid_argument, with the sensor and the field; unsupported for semantic sensors, for
  /// sensors of normals, and for noise.
  static Result<FreeSensors> create(std::vector<SensorSpec> sensors);

  /// The sensors.
  const std::vector<SensorSpec>& sensors() const noexcept { return sensors_; }
  /// Renders all sensors at one or more places. Sensors with equal cameras and equal poses share a
  /// render, and a sensor's cameras of all places are rendered in one call.
  /// @param poses One per sensor for the first place, then those of the next place.
  /// @param render Makes the frames.
  /// @param places Number of places, at least 1.
  /// @return invalid_argument for a wrong number of poses, or one that is not finite or not of unit
  /// length; an error of rendering.
  Status render(std::span<const SensorPose> poses, const Render& render, std::size_t places = 1);
  /// Number of pixels of a sensor's image.
  std::size_t pixels(std::size_t sensor) const noexcept;
  /// Writes the image of a sensor at a place of the last render, shape [height][width][channels].
  /// Several threads may call it at a time.
  /// @pre A render has succeeded, and none failed after it. `out` has the size of the image.
  void write(std::size_t sensor, std::size_t place, std::span<float> out) const;
  /// Writes the image of a colour sensor as bytes: red, green, blue and 255 for each pixel. See `write`.
  void write_rgba(std::size_t sensor, std::size_t place, std::span<std::uint8_t> out) const;
  /// Image of a sensor. See `write`.
  std::vector<float> image(std::size_t sensor, std::size_t place = 0) const;
  /// Number of calls that rendered so far; a cube counts as one.
  std::size_t render_count() const noexcept { return render_count_; }

 private:
  FreeSensors() = default;
  /// Drawn image of a sensor with a pinhole camera at a place.
  std::span<const float> drawn(std::size_t sensor, std::size_t place) const;
  /// Values of all faces or images that show a sensor.
  const std::vector<float>& values(std::size_t sensor) const;
  /// `poses` are those of all sensors and places.
  Status shoot(std::size_t sensor, std::span<const SensorPose> poses, const Render& render);

  std::vector<SensorSpec> sensors_;
  std::vector<std::shared_ptr<const CubeMap>> cubes_;  // Null for a pinhole.
  std::vector<Frames<float>> frames_;  // One per sensor; that of a shared render is at its first sensor.
  std::vector<std::size_t> drawn_;     // For each sensor, the one whose frames show it.
  std::size_t render_count_ = 0;
};

}  // namespace gsnav
