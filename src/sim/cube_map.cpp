// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/cube_map.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gsnav/detail/math/angles.hpp"

namespace gsnav {
namespace {

/// Rotation from the sensor to each face. Rows are the face's right, down and forward directions. Order:
/// forward, right, back, left, up, down.
constexpr std::array<Mat3d, CubeMap::kFaces> kFaceFromSensor{{
    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
    {{{0, 0, -1}, {0, 1, 0}, {1, 0, 0}}},
    {{{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}}},
    {{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}},
    {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}},
    {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}},
}};

/// Denominator of the double sphere projection for a unit vector with depth z.
double sphere_scale(const FisheyeLens& lens, double z) noexcept {
  const double shifted = lens.xi + z;
  return lens.alpha * std::sqrt(1.0 - z * z + shifted * shifted) + (1.0 - lens.alpha) * shifted;
}

std::array<double, 2> focal_length(const SensorSpec& s) noexcept {
  std::array<double, 2> f = s.fisheye.focal_length;
  const double half = radians(0.5 * s.hfov);
  const double fit = 0.5 * s.resolution[1] * sphere_scale(s.fisheye, std::cos(half)) / std::sin(half);
  for (double& v : f) v = v > 0 ? v : fit;
  return f;
}

std::optional<Vec3d> fisheye_ray(const SensorSpec& s, double u, double v) noexcept {
  const std::array<double, 2> f = focal_length(s);
  const double a = s.fisheye.alpha, xi = s.fisheye.xi;
  const double mx = (u - 0.5 * s.resolution[1] - s.fisheye.principal_point_offset[0]) / f[0];
  const double my = (v - 0.5 * s.resolution[0] - s.fisheye.principal_point_offset[1]) / f[1];
  const double r2 = mx * mx + my * my;
  if (a > 0.5 && r2 > 1.0 / (2.0 * a - 1.0)) return {};
  const double mz = (1.0 - a * a * r2) / (a * std::sqrt(1.0 - (2.0 * a - 1.0) * r2) + 1.0 - a);
  const double under = mz * mz + (1.0 - xi * xi) * r2;
  const double k = (mz * xi + std::sqrt(under)) / (mz * mz + r2);
  return Vec3d{k * mx, k * my, k * mz - xi};
}

}  // namespace

std::optional<Vec3d> sensor_ray(const SensorSpec& s, double u, double v) noexcept {
  const double height = s.resolution[0], width = s.resolution[1];
  if (s.model == SensorModel::fisheye) return fisheye_ray(s, u, v);
  if (s.model == SensorModel::equirectangular) {
    const double longitude = (u / width - 0.5) * 2.0 * std::numbers::pi,
                 latitude = (0.5 - v / height) * std::numbers::pi;
    return Vec3d{std::cos(latitude) * std::sin(longitude), -std::sin(latitude),
                 std::cos(latitude) * std::cos(longitude)};
  }
  const double f = Camera::focal_of_hfov(width, s.hfov);
  const Vec3d d{(u - 0.5 * width) / f, (v - 0.5 * height) / f, 1.0};
  return normalized(d);
}

CubeMap::CubeMap(const SensorSpec& spec) {
  const int height = spec.resolution[0], width = spec.resolution[1];
  const int inner = spec.cube_size > 0 ? spec.cube_size : std::max((width + 1) / 2, 2);
  side_ = inner + 2;
  const double f = 0.5 * inner;
  std::array<bool, kFaces> used{};
  taps_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const auto ray = sensor_ray(spec, column + 0.5, row + 0.5);
      if (!ray) continue;
      // The face whose axis is nearest to the ray. Its rays are within 45 degrees in each direction.
      std::size_t face = 0;
      for (std::size_t k = 1; k < kFaces; ++k) {
        if (dot(kFaceFromSensor[k].row[2], *ray) > dot(kFaceFromSensor[face].row[2], *ray)) face = k;
      }
      const Vec3d p = kFaceFromSensor[face] * *ray;
      Tap& tap = taps_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(column)];
      tap.face = static_cast<std::uint32_t>(face);
      tap.x = static_cast<float>(f * p.x / p.z + 0.5 * side_ - 0.5);
      tap.y = static_cast<float>(f * p.y / p.z + 0.5 * side_ - 0.5);
      tap.stretch = static_cast<float>(norm(p) / p.z);
      used[face] = true;
    }
  }
  for (std::size_t k = 0; k < kFaces; ++k) {
    if (used[k]) faces_.push_back(k);
  }
}

Camera CubeMap::face_camera(const Camera& sensor, std::size_t face) const noexcept {
  Camera c = sensor;
  const double inner = side_ - 2;
  c.set_hfov(side_, side_, 2.0 * std::atan(side_ / inner) * 180.0 / std::numbers::pi);
  c.viewmat.linear = kFaceFromSensor[face] * sensor.viewmat.linear;
  c.viewmat.translation = kFaceFromSensor[face] * sensor.viewmat.translation;
  return c;
}

namespace {

/// The four pixels around a position, and interpolation between them.
struct BilinearLookup {
  std::size_t first;  // Index of the upper left pixel.
  float fx, fy;
  BilinearLookup(float x, float y, int side) noexcept {
    const float most = static_cast<float>(side - 2);
    const float x0 = clamp(std::floor(x), 0.0f, most), y0 = clamp(std::floor(y), 0.0f, most);
    fx = clamp(x - x0, 0.0f, 1.0f);
    fy = clamp(y - y0, 0.0f, 1.0f);
    first = static_cast<std::size_t>(y0) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x0);
  }
  float mix(float a, float b, float c, float d) const noexcept {
    const float upper = a + fx * (b - a), lower = c + fx * (d - c);
    return upper + fy * (lower - upper);
  }
};

}  // namespace

void CubeMap::sample_color(const std::array<const float*, kFaces>& face_images, std::size_t channels,
                           std::span<float> out) const {
  const std::size_t below = static_cast<std::size_t>(side_) * channels;
  for (std::size_t i = 0; i < taps_.size(); ++i) {
    const Tap& tap = taps_[i];
    const BilinearLookup at(tap.x, tap.y, side_);
    for (std::size_t c = 0; c < channels; ++c) {
      if (tap.face == kFaces) {
        out[i * channels + c] = 0.0f;
        continue;
      }
      const float* p = face_images[tap.face] + at.first * channels + c;
      out[i * channels + c] = at.mix(p[0], p[channels], p[below], p[below + channels]);
    }
  }
}

void CubeMap::sample_depth(const std::array<const float*, kFaces>& face_images,
                           std::span<float> out) const {
  constexpr float kOneSurface = 1.02f;
  for (std::size_t i = 0; i < taps_.size(); ++i) {
    const Tap& tap = taps_[i];
    if (tap.face == kFaces) {
      out[i] = 0.0f;
      continue;
    }
    const BilinearLookup at(tap.x, tap.y, side_);
    const float* p = face_images[tap.face] + at.first;
    const float z[4] = {p[0], p[1], p[side_], p[side_ + 1]};
    const float least = std::min({z[0], z[1], z[2], z[3]}), most = std::max({z[0], z[1], z[2], z[3]});
    float seen = z[(at.fy >= 0.5f ? 2 : 0) + (at.fx >= 0.5f ? 1 : 0)];
    if (least > 0.0f && most < kOneSurface * least)
      seen = 1.0f / at.mix(1 / z[0], 1 / z[1], 1 / z[2], 1 / z[3]);
    out[i] = seen * tap.stretch;
  }
}

}  // namespace gsnav
