// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/sensor.hpp"

#include <cmath>
#include <numbers>

#include "gsnav/math/functions.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

std::vector<SensorSpec> rgbd_sensors(int height, int width, double hfov, const Vec3d& position) {
  SensorSpec rgb;
  rgb.resolution = {height, width};
  rgb.hfov = hfov;
  rgb.position = position;
  SensorSpec depth = rgb;
  depth.uuid = "depth";
  depth.kind = SensorKind::depth;
  return {rgb, depth};
}

std::vector<SensorSpec> pointnav_v2_sensors() {
  std::vector<SensorSpec> out = rgbd_sensors(360, 640, 70.0, {0.0, 0.88, 0.0});
  for (SensorSpec& s : out) {
    s.orientation = {-0.3490659, 0.0, 0.0};  // 20 degrees down.
    s.far_plane = 10.0;
  }
  out[0].noise.kind = NoiseKind::gaussian;
  out[0].noise.intensity = 0.1;
  out[1].noise.kind = NoiseKind::redwood_depth;
  return out;
}

Status validate(const SensorSpec& s) {
  const auto bad = [&](const char* field, const std::string& value, const char* rule) {
    return Status(Errc::invalid_argument,
                  "SensorSpec \"" + s.uuid + "\": " + field + " = " + value + ": " + rule);
  };
  if (s.uuid.empty()) return {Errc::invalid_argument, "SensorSpec.uuid is empty: a sensor needs a name"};
  if (s.kind > SensorKind::normal)
    return bad("kind", std::to_string(static_cast<int>(s.kind)), "not a value of the enum");
  if (s.model > SensorModel::fisheye)
    return bad("model", std::to_string(static_cast<int>(s.model)), "not a value of the enum");
  if (s.noise.kind > NoiseKind::salt_and_pepper) {
    return bad("noise.kind", std::to_string(static_cast<int>(s.noise.kind)), "not a value of the enum");
  }
  for (const int side : s.resolution) {
    if (side < 1 || side > kMaxImageSide)
      return bad("resolution", std::to_string(side), "must be in [1, 16384]");
  }
  const bool fisheye = s.model == SensorModel::fisheye;
  if (!(s.hfov > 0 && s.hfov < (fisheye ? 360 : 180))) {
    return bad("hfov", std::to_string(s.hfov),
               fisheye ? "must be in (0, 360) degrees" : "must be in (0, 180) degrees");
  }
  if (!(s.fisheye.alpha >= 0 && s.fisheye.alpha <= 1)) {
    return bad("fisheye.alpha", std::to_string(s.fisheye.alpha), "must be in [0, 1]");
  }
  if (!(s.fisheye.xi > -1 && s.fisheye.xi < 1)) {
    return bad("fisheye.xi", std::to_string(s.fisheye.xi), "must be in (-1, 1)");
  }
  for (const double f : s.fisheye.focal_length) {
    if (!(f >= 0 && is_finite(f))) return bad("fisheye.focal_length", std::to_string(f), "must be >= 0");
  }
  for (const double f : s.fisheye.principal_point_offset) {
    if (!is_finite(f)) return bad("fisheye.principal_point_offset", std::to_string(f), "must be finite");
  }
  if (fisheye && (!(s.fisheye.focal_length[0] > 0) || !(s.fisheye.focal_length[1] > 0))) {
    // Limit of the double sphere projection. Beyond it, two directions would share an image point.
    const double a = s.fisheye.alpha, z = std::cos(s.hfov * std::numbers::pi / 360.0),
                 shifted = s.fisheye.xi + z;
    const double w = a > 0.5 ? (1 - a) / a : a / (1 - a);
    if (!(shifted > -w * std::sqrt(1 - z * z + shifted * shifted))) {
      return bad("hfov", std::to_string(s.hfov),
                 "is more than a lens of this fisheye.alpha and xi sees");
    }
  }
  if (s.cube_size < 0 || s.cube_size > kMaxImageSide - 2) {
    return bad("cube_size", std::to_string(s.cube_size), "must be in [0, 16382]");
  }
  if (s.kind == SensorKind::semantic && s.model != SensorModel::pinhole) {
    return bad("model", "not pinhole", "semantic sensors are pinholes");
  }
  if (s.kind == SensorKind::normal && s.model != SensorModel::pinhole) {
    return bad("model", "not pinhole", "sensors of normals are pinholes");
  }
  if (Status noise = validate(s.noise, s.uuid.c_str()); !noise) return noise;
  const SensorKind noisy = is_color_noise(s.noise.kind) ? SensorKind::rgb : SensorKind::depth;
  if (s.noise.kind != NoiseKind::none && s.kind != noisy) {
    return bad("noise.kind", noisy == SensorKind::rgb ? "noise of colour" : "redwood_depth",
               "redwood_depth is for depth, other noise for colour");
  }
  if (!is_finite(s.position)) return bad("position", "not finite", "must be finite");
  if (!is_finite(s.orientation)) return bad("orientation", "not finite", "must be finite");
  if (!(s.near_plane > 0 && is_finite(s.near_plane))) {
    return bad("near_plane", std::to_string(s.near_plane), "must be positive");
  }
  if (!(s.near_sigma >= 0 && is_finite(s.near_sigma))) {
    return bad("near_sigma", std::to_string(s.near_sigma), "must be >= 0");
  }
  if (!(s.far_plane > s.near_plane)) {
    return bad("far_plane", std::to_string(s.far_plane), "must be beyond near_plane");
  }
  return {};
}

Status validate(std::span<const SensorSpec> sensors) {
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    if (Status s = validate(sensors[i]); !s) return s;
    for (std::size_t j = 0; j < i; ++j) {
      if (sensors[i].uuid == sensors[j].uuid) {
        return {Errc::invalid_argument, "SensorSpec.uuid \"" + sensors[i].uuid + "\" is used twice"};
      }
    }
  }
  return {};
}

bool same_camera(const SensorSpec& a, const SensorSpec& b) noexcept {
  return a.model == b.model && a.cube_size == b.cube_size && a.fisheye.alpha == b.fisheye.alpha &&
         a.fisheye.xi == b.fisheye.xi && a.fisheye.focal_length == b.fisheye.focal_length &&
         a.fisheye.principal_point_offset == b.fisheye.principal_point_offset &&
         a.resolution == b.resolution && a.hfov == b.hfov && a.position == b.position &&
         a.orientation == b.orientation && a.near_plane == b.near_plane &&
         a.near_sigma == b.near_sigma && a.far_plane == b.far_plane;
}

Camera sensor_camera(const SensorSpec& spec, const Vec3d& base, const Quatd& rotation,
                     double pitch) noexcept {
  const Vec3d& o = spec.orientation;
  const Quatd local = axis_angle(Vec3d{0, 0, 1}, o.z) * axis_angle(Vec3d{0, 1, 0}, o.y) *
                      axis_angle(Vec3d{1, 0, 0}, o.x + pitch);
  const Mat3d sensor_from_world = transpose(rotation_matrix(rotation * local));
  Camera c;
  c.set_hfov(spec.resolution[1], spec.resolution[0], spec.hfov);
  c.viewmat.linear = {{sensor_from_world.row[0], -sensor_from_world.row[1], -sensor_from_world.row[2]}};
  c.viewmat.translation = -(c.viewmat.linear * (base + rotate(rotation, spec.position)));
  c.near_plane = spec.near_plane;
  c.near_sigma = spec.near_sigma;
  return c;
}

void to_bytes(std::span<const float> rgb, std::span<std::uint8_t> out) noexcept {
  for (std::size_t i = 0; i < rgb.size() && i < out.size(); ++i) {
    out[i] = to_byte(rgb[i]);
  }
}

}  // namespace gsnav
