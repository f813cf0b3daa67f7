// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  /// Renders all sensors. Those with equal cameras and equal poses share a render.
  /// @param poses One per sensor.
  /// @param render Makes the frames.
  /// @return invalid_argument for a wrong number of poses, or one that is not finite or not of unit
  /// length; an error of rendering.
  Status render(std::span<const SensorPose> poses, const Render& render);
  /// Image of a sensor, shape [height][width][channels]. Empty before the first render, valid until the
  /// next.
  std::span<const float> image(std::size_t sensor) const noexcept { return images_[sensor]; }
  /// Number of renders so far; a cube counts as one.
  std::size_t render_count() const noexcept { return render_count_; }

 private:
  FreeSensors() = default;
  Status shoot(std::size_t sensor, const SensorPose& pose, const Render& render);
  void fill(std::size_t sensor, std::size_t drawn);

  std::vector<SensorSpec> sensors_;
  std::vector<std::shared_ptr<const CubeMap>> cubes_;  // Null for a pinhole.
  std::vector<std::vector<float>> images_;
  std::vector<Frames<float>> frames_;  // One per sensor; that of a shared render is at its first sensor.
  std::size_t render_count_ = 0;
};

}  // namespace gsnav
