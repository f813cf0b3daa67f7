// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/sim/free_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "gsnav/detail/frame/cut_depth.hpp"

namespace gsnav {
namespace {

bool finite_unit(const Quatd& q) noexcept {
  const double n = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  return std::abs(n - 1) < 1e-4;  // False for NaN.
}

bool equal(const SensorPose& a, const SensorPose& b) noexcept {
  const Quatd &p = a.rotation, &q = b.rotation;
  return a.position.x == b.position.x && a.position.y == b.position.y && a.position.z == b.position.z &&
         p.w == q.w && p.x == q.x && p.y == q.y && p.z == q.z;
}

}  // namespace

Result<FreeSensors> FreeSensors::create(std::vector<SensorSpec> sensors) {
  for (SensorSpec& s : sensors) {
    s.position = {};
    s.orientation = {};
    if (s.kind != SensorKind::rgb && s.kind != SensorKind::depth && s.kind != SensorKind::alpha) {
      return {Errc::unsupported,
              "SensorSpec \"" + s.uuid + "\": free sensors have colour, depth or alpha"};
    }
    if (s.noise.kind != NoiseKind::none) {
      return {Errc::unsupported, "SensorSpec \"" + s.uuid + "\": free sensors have no noise"};
    }
  }
  if (Status s = validate(std::span<const SensorSpec>(sensors)); !s) return s;
  FreeSensors out;
  for (const SensorSpec& s : sensors) {
    const bool pinhole = s.model == SensorModel::pinhole;
    std::shared_ptr<const CubeMap> cube;
    for (std::size_t i = 0; !pinhole && i < out.cubes_.size(); ++i) {
      if (same_camera(sensors[i], s)) cube = out.cubes_[i];
    }
    if (!pinhole && cube == nullptr) cube = std::make_shared<const CubeMap>(s);
    out.cubes_.push_back(std::move(cube));
  }
  out.images_.resize(sensors.size());
  out.frames_.resize(sensors.size());
  out.sensors_ = std::move(sensors);
  return out;
}

Status FreeSensors::render(std::span<const SensorPose> poses, const Render& render) {
  if (poses.size() != sensors_.size()) {
    return {Errc::invalid_argument, "FreeSensors: " + std::to_string(poses.size()) + " poses for " +
                                        std::to_string(sensors_.size()) + " sensors"};
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!is_finite(poses[i].position) || !finite_unit(poses[i].rotation)) {
      return {Errc::invalid_argument,
              "SensorPose of \"" + sensors_[i].uuid +
                  "\": the position must be finite and the rotation have unit length"};
    }
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    std::size_t drawn = 0;
    while (drawn < i && !(same_camera(sensors_[drawn], sensors_[i]) && equal(poses[drawn], poses[i])))
      ++drawn;
    if (drawn == i) {
      if (Status s = shoot(i, poses[i], render); !s) return s;
    }
    fill(i, drawn);
  }
  return {};
}

Status FreeSensors::shoot(std::size_t sensor, const SensorPose& pose, const Render& render) {
  const Camera camera = sensor_camera(sensors_[sensor], pose.position, pose.rotation);
  ++render_count_;
  if (cubes_[sensor] == nullptr) return render(std::span(&camera, 1), frames_[sensor]);
  std::vector<Camera> faces;
  for (const std::size_t face : cubes_[sensor]->faces())
    faces.push_back(cubes_[sensor]->face_camera(camera, face));
  return render(faces, frames_[sensor]);
}

void FreeSensors::fill(std::size_t sensor, std::size_t drawn) {
  const SensorSpec& spec = sensors_[sensor];
  const Frames<float>& frames = frames_[drawn];
  const bool depth = spec.kind == SensorKind::depth;
  const std::vector<float>& from = depth                          ? frames.median_depth
                                   : spec.kind == SensorKind::rgb ? frames.rgb
                                                                  : frames.alpha;
  std::vector<float>& out = images_[sensor];
  const auto channels = static_cast<std::size_t>(channels_of(spec.kind));
  out.resize(static_cast<std::size_t>(spec.resolution[0]) *
             static_cast<std::size_t>(spec.resolution[1]) * channels);
  if (const CubeMap* const cube = cubes_[sensor].get()) {
    const std::size_t face_size =
        static_cast<std::size_t>(cube->side()) * static_cast<std::size_t>(cube->side()) * channels;
    std::array<const float*, CubeMap::kFaces> faces{};
    std::size_t next = 0;
    for (const std::size_t face : cube->faces()) faces[face] = from.data() + face_size * next++;
    if (depth) {
      cube->sample_depth(faces, out);
    } else {
      cube->sample_color(faces, channels, out);
    }
  } else {
    std::copy(from.begin(), from.end(), out.begin());
  }
  if (!depth) return;
  const CutDepth cut(out.data(), spec.far_plane);
  for (std::size_t i = 0; i < out.size(); ++i) cut(i);
}

}  // namespace gsnav
