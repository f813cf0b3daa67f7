// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/detail/sim/noise.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Kind of image that a sensor produces.
enum class SensorKind : std::uint8_t {
  rgb,    ///< Colour, float32 [height][width][3], display-referred, 0 to 1 and above.
  depth,  ///< Median depth, float32 [height][width], metres. 0: no return. Planar z for pinholes,
          ///< distance along the ray for other models.
  alpha,  ///< Covered fraction of the pixel, float32 [height][width].
  /// Id of the object that covers most of the pixel, float32 [height][width]. 1 to n in the order
  /// assets, avatars, meshes; 0 is background.
  semantic,
  /// Unit normal of the mesh that the depth sensor would see, float32 [height][width][3], towards the
  /// camera, in the sensor's axes (x right, y up, looking along -z). 0 elsewhere. Host backends only.
  normal,
};

/// Camera model of a sensor.
enum class SensorModel : std::uint8_t {
  /// Perspective projection.
  pinhole,
  equirectangular,  ///< Full sphere. Columns are longitude from -180 to 180 degrees, rows are latitude
                    ///< from 90 to -90 degrees.
  fisheye,  ///< Double sphere model (Usenko et al. 2018). Pixels outside its field of view are black
            ///< with depth 0.
};

/// Parameters of the double sphere model. The defaults are those of Habitat.
struct FisheyeLens {
  double alpha = 0.59, xi = -0.18;  ///< Parameters of the model.
  /// Focal lengths in pixels. 0: chosen so that the middle row spans the sensor's hfov, which the lens
  /// must cover.
  std::array<double, 2> focal_length{0.0, 0.0};
  std::array<double, 2> principal_point_offset{0.0, 0.0};  ///< Offset from the image centre, pixels.
};

/// A camera fixed to the agent. Conventions and defaults are those of Habitat.
struct SensorSpec {
  std::string uuid = "rgb";                  ///< Name of the observation, unique per agent.
  SensorKind kind = SensorKind::rgb;         ///< Quantity that the sensor measures.
  SensorModel model = SensorModel::pinhole;  ///< Camera model.
  std::array<int, 2> resolution{256, 256};   ///< Height and width in pixels.
  double hfov = 90.0;                        ///< Horizontal field of view, degrees. Pixels are square.
  Vec3d position{0.0, 1.5, 0.0};             ///< Position relative to the agent's base, agent frame,
                                             ///< metres.
  Vec3d orientation{};                       ///< Euler angles about X, then Y, then Z, radians.
  double near_plane = 0.01;                  ///< Near plane, metres.
  double near_sigma = 1.0;                   ///< See Camera::near_sigma.
  double far_plane = 1000.0;                 ///< Far plane, metres. Depth beyond it is no return.
  FisheyeLens fisheye{};                     ///< Lens of SensorModel::fisheye.
  /// Edge of the cube of pinhole images that other models are resampled from, in pixels. 0: half the
  /// image width.
  int cube_size = 0;
  NoiseModel noise{};  ///< Noise that is added to the image.
};

/// An RGB and a depth sensor ("rgb", "depth") at the same position. They share one render.
std::vector<SensorSpec> rgbd_sensors(int height = 256, int width = 256, double hfov = 90.0,
                                     const Vec3d& position = {0.0, 1.5, 0.0});

/// Sensors of the PointNav v2 challenge: 360 x 640 pixels, 70 degrees, 0.88 m high, tilted down by 20
/// degrees, with noise.
std::vector<SensorSpec> pointnav_v2_sensors();

/// Number of channels of a sensor's image.
inline int channels_of(SensorKind kind) noexcept {
  return kind == SensorKind::rgb || kind == SensorKind::normal ? 3 : 1;
}

/// Checks a sensor.
/// @return invalid_argument, with the sensor and the field that is out of range.
Status validate(const SensorSpec& spec);

/// Checks all sensors of an agent, and that their names are unique.
/// @return invalid_argument, with the sensor and the field.
Status validate(std::span<const SensorSpec> sensors);

/// Returns true if both sensors have the same camera, so that one render serves both.
bool same_camera(const SensorSpec& a, const SensorSpec& b) noexcept;

/// Camera of a pinhole sensor on an agent. This is the only place where Habitat's camera (x right, y up,
/// looking along -z) becomes the library's (x right, y down, looking along +z).
/// @param spec Sensor with SensorModel::pinhole.
/// @param base World position of the agent's base, metres.
/// @param rotation Orientation of the agent.
/// @param pitch Tilt of the sensor, radians, positive upwards.
Camera sensor_camera(const SensorSpec& spec, const Vec3d& base, const Quatd& rotation,
                     double pitch = 0.0) noexcept;

/// Converts display-referred colours to 8 bit: round(255 clamp(c, 0, 1)). @pre out.size() >= rgb.size().
void to_bytes(std::span<const float> rgb, std::span<std::uint8_t> out) noexcept;

}  // namespace gsnav
