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

/// What a sensor measures.
enum class SensorKind : std::uint8_t {
  rgb,    ///< [H][W][3] float32, display-referred, 0 to 1 and above
  depth,  ///< [H][W] float32, metres (median), 0: no return; planar z, along the ray where not pinhole
  alpha,  ///< [H][W] float32, how much of the pixel is covered
  /// [H][W] float32, whose most of the pixel is: 1, 2, ... the scene's assets, its avatars, its meshes;
  /// 0: nobody's
  semantic,
  /// [H][W][3] float32, where the depth sensor would see a mesh that surface's normal, unit, on the
  /// camera's side, in the sensor's axes (x right, y up, looking along -z); 0 elsewhere. Host backends.
  normal,
};

/// How directions become pixels.
enum class SensorModel : std::uint8_t {
  pinhole,
  equirectangular,  ///< all around: columns are longitude from -180 to 180 degrees, rows latitude from
                    ///< 90 to -90
  fisheye,  ///< double sphere (Usenko et al. 2018); directions that it does not see are black, depth 0
};

/// The double sphere model. The defaults are Habitat's.
struct FisheyeLens {
  double alpha = 0.59, xi = -0.18;  ///< Parameters of the double sphere model.
  /// Pixels; 0: such that the middle row spans the sensor's hfov, which the lens must see.
  std::array<double, 2> focal_length{0.0, 0.0};
  std::array<double, 2> principal_point_offset{0.0, 0.0};  ///< from the image's centre, pixels
};

/// A sensor fixed to the agent, with Habitat's conventions and defaults.
struct SensorSpec {
  std::string uuid = "rgb";                  ///< names the observation; unique
  SensorKind kind = SensorKind::rgb;         ///< What the sensor measures.
  SensorModel model = SensorModel::pinhole;  ///< How directions become pixels.
  std::array<int, 2> resolution{256, 256};   ///< height, width in pixels
  double hfov = 90.0;                        ///< horizontal field of view, degrees; square pixels
  Vec3d position{0.0, 1.5, 0.0};             ///< from the agent's base, agent frame, metres
  Vec3d orientation{};                       ///< Euler angles about X, then Y, then Z, radians
  double near_plane = 0.01;                  ///< metres
  double near_sigma = 1.0;                   ///< see Camera::near_sigma
  double far_plane = 1000.0;                 ///< metres; depth beyond it is no return
  FisheyeLens fisheye{};                     ///< Lens of the fisheye model.
  /// Pixels along the edge of the cube of pinhole images that other models are sampled from; 0: half the
  /// width.
  int cube_size = 0;
  NoiseModel noise{};  ///< Noise that is added.
};

/// An RGB and a depth sensor ("rgb", "depth") at one place: they share one render.
std::vector<SensorSpec> rgbd_sensors(int height = 256, int width = 256, double hfov = 90.0,
                                     const Vec3d& position = {0.0, 1.5, 0.0});

/// The sensors of the PointNav v2 challenge: 360x640, 70 degrees, 0.88 m high, looking down by 20
/// degrees, with noise.
std::vector<SensorSpec> pointnav_v2_sensors();

/// Channels of a sensor's image.
inline int channels_of(SensorKind kind) noexcept {
  return kind == SensorKind::rgb || kind == SensorKind::normal ? 3 : 1;
}

/// invalid_argument, naming the sensor and its field, where a value is impossible.
Status validate(const SensorSpec& spec);

/// The same of each of a body's sensors; also where two have one name.
Status validate(std::span<const SensorSpec> sensors);

/// True where both sensors see through one camera, so that one render serves them.
bool same_camera(const SensorSpec& a, const SensorSpec& b) noexcept;

/// The camera of a pinhole sensor on an agent at `base` (world, metres), turned by `rotation`, the
/// sensor tilted by `pitch` (radians, positive upwards). Here, and nowhere else, Habitat's camera (x
/// right, y up, looking along -z) becomes the library's (x right, y down, looking along +z).
Camera sensor_camera(const SensorSpec& spec, const Vec3d& base, const Quatd& rotation,
                     double pitch = 0.0) noexcept;

/// Converts display-referred colour to 8 bit: round(255 clamp(c, 0, 1)). `out` has room for rgb.size().
void to_bytes(std::span<const float> rgb, std::span<std::uint8_t> out) noexcept;

}  // namespace gsnav
