// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/kernels/camera.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

enum class SensorKind : std::uint8_t {
  rgb,    ///< [H][W][3] float32, display-referred, 0 to 1 and above
  depth,  ///< [H][W] float32, planar z in metres (median), 0: no return
  alpha,  ///< [H][W] float32, how much of the pixel is covered
};

/// A pinhole sensor fixed to the agent, with Habitat's conventions and defaults.
struct SensorSpec {
  std::string uuid = "rgb";  ///< names the observation; unique
  SensorKind kind = SensorKind::rgb;
  std::array<int, 2> resolution{256, 256};  ///< height, width in pixels
  double hfov = 90.0;                       ///< horizontal field of view, degrees; square pixels
  Vec3d position{0.0, 1.5, 0.0};            ///< from the agent's base, agent frame, metres
  Vec3d orientation{};                      ///< Euler angles about X, then Y, then Z, radians
  double near_plane = 0.01;                 ///< metres
  double near_sigma = 1.0;                  ///< see Camera::near_sigma
  double far_plane = 1000.0;                ///< metres; depth beyond it is no return
};

/// An RGB and a depth sensor ("rgb", "depth") at one place: they share one render.
std::vector<SensorSpec> rgbd_sensors(int height = 256, int width = 256, double hfov = 90.0,
                                     const Vec3d& position = {0.0, 1.5, 0.0});

/// invalid_argument, naming the sensor and its field, where a value is impossible.
Status validate(const SensorSpec& spec);

/// True where both sensors see through one camera, so that one render serves them.
bool same_camera(const SensorSpec& a, const SensorSpec& b) noexcept;

/// The camera of a sensor on an agent at `base` (world, metres), turned by `rotation`. Here, and
/// nowhere else, Habitat's camera (x right, y up, looking along -z) becomes the library's (x right,
/// y down, looking along +z).
Camera sensor_camera(const SensorSpec& spec, const Vec3d& base, const Quatd& rotation) noexcept;

/// Converts display-referred colour to 8 bit: round(255 clamp(c, 0, 1)). `out` has room for rgb.size().
void to_bytes(std::span<const float> rgb, std::span<std::uint8_t> out) noexcept;

}  // namespace gsnav
