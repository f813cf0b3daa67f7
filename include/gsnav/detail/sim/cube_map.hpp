// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gsnav/detail/sim/sensor.hpp"
#include "gsnav/image/camera.hpp"

namespace gsnav {

/// The direction that the pixel with centre (u, v) of a sensor sees, unit, in the frame of its camera (x
/// right, y down, z forward); none where the model does not see. (u, v) in pixels from the top-left
/// corner.
std::optional<Vec3d> sensor_ray(const SensorSpec& spec, double u, double v) noexcept;

/// Images of sensors that are not pinholes, sampled from pinhole images on the faces of a cube around
/// them.
///
/// A face spans 90 degrees in `cube_size` pixels and one more on each side, so that colour is
/// interpolated between neighbours without looking at another face. Depth is interpolated (in 1/z, exact
/// on planes) where its four neighbours lie on one surface, that is within 2 %, and else taken from the
/// nearest.
class CubeMap {
 public:
  static constexpr std::size_t kFaces = 6;  ///< Faces of a cube.
  CubeMap() = default;
  explicit CubeMap(const SensorSpec& spec);  ///< Cube for a sensor that is no pinhole camera.

  /// Pixels along a face, the border included.
  int side() const noexcept { return side_; }
  /// The faces that some pixel looks at; the others need no image.
  std::span<const std::size_t> faces() const noexcept { return faces_; }
  /// The camera of a face, given what sensor_camera() makes of the sensor.
  Camera face_camera(const Camera& sensor, std::size_t face) const noexcept;

  /// Writes the sensor's image. `face_images[f]` is [side][side][channels] and read where f is one of
  /// faces().
  void sample_color(const std::array<const float*, kFaces>& face_images, std::size_t channels,
                    std::span<float> out) const;
  /// The same for depth: planar z of the faces becomes distance along the ray.
  void sample_depth(const std::array<const float*, kFaces>& face_images, std::span<float> out) const;

 private:
  struct Tap {
    float x = 0, y = 0;  // in the face's pixels, from the centre of its first
    float stretch = 0;   // distance along the ray over planar z
    std::uint32_t face = kFaces;
  };
  std::vector<Tap> taps_;
  std::vector<std::size_t> faces_;
  int side_ = 0;
};

}  // namespace gsnav
