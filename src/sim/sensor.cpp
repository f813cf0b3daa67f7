// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/sensor.hpp"

#include <cmath>
#include <numbers>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/math/functions.hpp"
#include "gsnav/render/config.hpp"

namespace gsnav {

std::vector<SensorSpec> rgbd_sensors(int height, int width, double hfov, const Vec3d& position) {
  SensorSpec rgb{.resolution = {height, width}, .hfov = hfov, .position = position};
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
  if (s.uuid.empty()) return {Errc::invalid_argument, "SensorSpec.uuid is empty: a sensor needs a name"};
  detail::FieldCheck check("SensorSpec \"" + s.uuid + "\": ");
  const auto known = [&check](const char* field, auto value, auto last) {
    check.need(value <= last, field, static_cast<int>(value), "not a value of the enum");
  };
  known("kind", s.kind, SensorKind::normal);
  known("model", s.model, SensorModel::fisheye);
  known("noise.kind", s.noise.kind, NoiseKind::salt_and_pepper);
  for (const int side : s.resolution) check.in("resolution", side, 1, kMaxImageSide);
  const bool fisheye = s.model == SensorModel::fisheye, pinhole = s.model == SensorModel::pinhole;
  check.need(s.hfov > 0 && s.hfov < (fisheye ? 360 : 180), "hfov", s.hfov,
             fisheye ? "must be in (0, 360) degrees" : "must be in (0, 180) degrees");
  check.in("fisheye.alpha", s.fisheye.alpha, 0, 1);
  check.need(s.fisheye.xi > -1 && s.fisheye.xi < 1, "fisheye.xi", s.fisheye.xi, "must be in (-1, 1)");
  for (const double f : s.fisheye.focal_length) check.not_negative("fisheye.focal_length", f);
  for (const double f : s.fisheye.principal_point_offset)
    check.finite("fisheye.principal_point_offset", f);
  if (fisheye && (!(s.fisheye.focal_length[0] > 0) || !(s.fisheye.focal_length[1] > 0))) {
    // Limit of the double sphere projection. Beyond it, two directions would share an image point.
    const double a = s.fisheye.alpha, z = std::cos(s.hfov * std::numbers::pi / 360.0),
                 shifted = s.fisheye.xi + z;
    const double w = a > 0.5 ? (1 - a) / a : a / (1 - a);
    check.need(shifted > -w * std::sqrt(1 - z * z + shifted * shifted), "hfov", s.hfov,
               "is more than a lens of this fisheye.alpha and xi sees");
  }
  check.in("cube_size", s.cube_size, 0, kMaxImageSide - 2);
  check.need(s.kind != SensorKind::semantic || pinhole, "model", "not pinhole",
             "semantic sensors are pinholes");
  check.need(s.kind != SensorKind::normal || pinhole, "model", "not pinhole",
             "sensors of normals are pinholes");
  if (!check.status()) return check.status();
  if (Status noise = validate(s.noise, s.uuid.c_str()); !noise) return noise;
  const bool of_color = is_color_noise(s.noise.kind);
  check.need(
      s.noise.kind == NoiseKind::none || s.kind == (of_color ? SensorKind::rgb : SensorKind::depth),
      "noise.kind", of_color ? "noise of colour" : "redwood_depth",
      "redwood_depth is for depth, other noise for colour");
  check.need(is_finite(s.position), "position", "not finite", "must be finite");
  check.need(is_finite(s.orientation), "orientation", "not finite", "must be finite");
  check.positive("near_plane", s.near_plane).not_negative("near_sigma", s.near_sigma);
  check.need(s.far_plane > s.near_plane, "far_plane", s.far_plane, "must be beyond near_plane");
  return check.status();
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
