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
  out.frames_.resize(sensors.size());
  out.drawn_.resize(sensors.size());
  out.sensors_ = std::move(sensors);
  return out;
}

Status FreeSensors::render(std::span<const SensorPose> poses, const Render& render, std::size_t places) {
  const std::size_t n = sensors_.size();
  if (places == 0 || poses.size() != n * places) {
    return {Errc::invalid_argument, "FreeSensors: " + std::to_string(poses.size()) + " poses for " +
                                        std::to_string(n) + " sensors at " + std::to_string(places) +
                                        " places"};
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!is_finite(poses[i].position) || !finite_unit(poses[i].rotation)) {
      return {Errc::invalid_argument,
              "SensorPose of \"" + sensors_[i % n].uuid +
                  "\": the position must be finite and the rotation have unit length"};
    }
  }
  const auto same = [&](std::size_t a, std::size_t b) {
    if (!same_camera(sensors_[a], sensors_[b])) return false;
    for (std::size_t at = 0; at < poses.size(); at += n) {
      if (!equal(poses[at + a], poses[at + b])) return false;
    }
    return true;
  };
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t drawn = 0;
    while (drawn < i && !same(drawn, i)) ++drawn;
    drawn_[i] = drawn;
    if (drawn == i) {
      if (Status s = shoot(i, poses, render); !s) return s;
    }
  }
  return {};
}

Status FreeSensors::shoot(std::size_t sensor, std::span<const SensorPose> poses, const Render& render) {
  ++render_count_;
  std::vector<Camera> cameras;
  for (std::size_t at = sensor; at < poses.size(); at += sensors_.size()) {
    const Camera camera = sensor_camera(sensors_[sensor], poses[at].position, poses[at].rotation);
    const CubeMap* const cube = cubes_[sensor].get();
    if (cube == nullptr) {
      cameras.push_back(camera);
    } else {
      for (const std::size_t face : cube->faces()) cameras.push_back(cube->face_camera(camera, face));
    }
  }
  return render(cameras, frames_[sensor]);
}

std::size_t FreeSensors::pixels(std::size_t sensor) const noexcept {
  const SensorSpec& spec = sensors_[sensor];
  return static_cast<std::size_t>(spec.resolution[0]) * static_cast<std::size_t>(spec.resolution[1]);
}

const std::vector<float>& FreeSensors::values(std::size_t sensor) const {
  const Frames<float>& frames = frames_[drawn_[sensor]];
  const SensorKind kind = sensors_[sensor].kind;
  return kind == SensorKind::depth ? frames.median_depth
         : kind == SensorKind::rgb ? frames.rgb
                                   : frames.alpha;
}

std::span<const float> FreeSensors::drawn(std::size_t sensor, std::size_t place) const {
  const std::size_t size = pixels(sensor) * static_cast<std::size_t>(channels_of(sensors_[sensor].kind));
  return std::span(values(sensor)).subspan(place * size, size);
}

void FreeSensors::write(std::size_t sensor, std::size_t place, std::span<float> out) const {
  const SensorSpec& spec = sensors_[sensor];
  const bool depth = spec.kind == SensorKind::depth;
  const auto channels = static_cast<std::size_t>(channels_of(spec.kind));
  if (const CubeMap* const cube = cubes_[sensor].get()) {
    const std::size_t face_size =
        static_cast<std::size_t>(cube->side()) * static_cast<std::size_t>(cube->side()) * channels;
    std::array<const float*, CubeMap::kFaces> faces{};
    const float* next = values(sensor).data() + place * cube->faces().size() * face_size;
    for (const std::size_t face : cube->faces()) {
      faces[face] = next;
      next += face_size;
    }
    if (depth) {
      cube->sample_depth(faces, out);
    } else {
      cube->sample_color(faces, channels, out);
    }
  } else {
    std::ranges::copy(drawn(sensor, place), out.begin());
  }
  if (depth) {
    const CutDepth cut(out.data(), spec.far_plane);
    for (std::size_t i = 0; i < out.size(); ++i) cut(i);
  }
}

void FreeSensors::write_rgba(std::size_t sensor, std::size_t place, std::span<std::uint8_t> out) const {
  std::vector<float> sampled;
  std::span<const float> rgb;
  if (cubes_[sensor] == nullptr) {
    rgb = drawn(sensor, place);
  } else {
    sampled = image(sensor, place);
    rgb = sampled;
  }
  for (std::size_t p = 0; p < rgb.size() / 3; ++p) {
    for (std::size_t c = 0; c < 3; ++c) out[4 * p + c] = to_byte(rgb[3 * p + c]);
    out[4 * p + 3] = 255;
  }
}

std::vector<float> FreeSensors::image(std::size_t sensor, std::size_t place) const {
  std::vector<float> out(pixels(sensor) * static_cast<std::size_t>(channels_of(sensors_[sensor].kind)));
  write(sensor, place, out);
  return out;
}

}  // namespace gsnav
