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

/// Viewing direction of a pixel of a sensor: a unit vector in the camera's frame (x right, y down, z
/// forward). Nothing if the model does not see there.
/// @param spec Sensor with its camera model and resolution.
/// @param u, v Position in pixels from the top-left corner of the image. Pixel centres are at
/// half-integers.
std::optional<Vec3d> sensor_ray(const SensorSpec& spec, double u, double v) noexcept;

/// Resamples images for sensors that are not pinhole cameras, from pinhole images on the faces of a cube
/// around them.
///
/// A face spans 90 degrees with `cube_size` pixels and has a border of one pixel, so that colours can be
/// interpolated without another face. Depth is interpolated in 1/z (exact on planes) if its four
/// neighbours are within 2 %, that is, on one surface. Otherwise the nearest one is used.
class CubeMap {
 public:
  /// Faces of a cube.
  static constexpr std::size_t kFaces = 6;
  CubeMap() = default;
  /// Computes for each pixel of the sensor where on the cube it looks.
  explicit CubeMap(const SensorSpec& spec);

  /// Width of a face in pixels, border included.
  int side() const noexcept { return side_; }
  /// Faces that some pixel looks at. The others need no image.
  std::span<const std::size_t> faces() const noexcept { return faces_; }
  /// Camera of a face. `sensor` is the result of sensor_camera().
  Camera face_camera(const Camera& sensor, std::size_t face) const noexcept;

  /// Writes the colour image of the sensor.
  /// @param face_images Images of the faces, shape [side][side][channels]. Only the elements in faces()
  /// are read.
  /// @param channels Number of channels of the images.
  /// @param out Image of the sensor, shape [height][width][channels].
  void sample_color(const std::array<const float*, kFaces>& face_images, std::size_t channels,
                    std::span<float> out) const;
  /// Writes the depth image of the sensor. Planar z of the faces becomes distance along the ray.
  void sample_depth(const std::array<const float*, kFaces>& face_images, std::span<float> out) const;

 private:
  struct Tap {
    float x = 0, y = 0;  // Position in the face, in pixels from the centre of its first pixel.
    float stretch = 0;   // Distance along the ray divided by planar z.
    std::uint32_t face = kFaces;
  };
  std::vector<Tap> taps_;
  std::vector<std::size_t> faces_;
  int side_ = 0;
};

}  // namespace gsnav
