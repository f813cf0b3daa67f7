// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "gsnav/detail/sim/cube_map.hpp"
#include "gsnav/detail/sim/sensor.hpp"

namespace gsnav {

/// Cameras and image buffers that the sensors of an agent need. Sensors with the same position and field
/// of view share a camera. Sensors of the same kind on one camera share a buffer.
class SensorPlan {
 public:
  static constexpr std::size_t kNone = ~std::size_t{0};
  static constexpr auto kDepth = static_cast<std::size_t>(SensorKind::depth);
  static constexpr auto kSemantic = static_cast<std::size_t>(SensorKind::semantic);
  static constexpr auto kNormal = static_cast<std::size_t>(SensorKind::normal), kKinds = kNormal + 1;

  /// Sensors that share a camera.
  struct Group {
    std::size_t sensor = 0;  ///< Index of one of them.
    std::array<std::size_t, kKinds> buffer{kNone, kNone, kNone, kNone, kNone};
    std::shared_ptr<const CubeMap> cube;  ///< Null for a pinhole.

    bool has(std::size_t kind) const noexcept { return buffer[kind] != kNone; }
  };
  /// Buffers of a sensor without and with noise. Equal if the sensor has no noise.
  struct SensorBuffers {
    std::size_t clean, noisy;
  };

  /// Assigns a camera and buffers to each of `sensors`. Precondition: validate() accepts each of them.
  explicit SensorPlan(std::vector<SensorSpec> sensors) : sensors_(std::move(sensors)) {
    for (std::size_t i = 0; i < sensors_.size(); ++i) {
      Group& group = group_of(i);
      const auto kind = static_cast<std::size_t>(sensors_[i].kind);
      if (!group.has(kind)) group.buffer[kind] = add_buffer(i);
      SensorBuffers own{group.buffer[kind], group.buffer[kind]};
      if (sensors_[i].noise.kind != NoiseKind::none) own.noisy = add_buffer(i);
      of_sensor_.push_back(own);
    }
  }

  const std::vector<SensorSpec>& sensors() const noexcept { return sensors_; }
  const std::vector<Group>& groups() const noexcept { return groups_; }
  const SensorBuffers& buffers_of(std::size_t sensor) const noexcept { return of_sensor_[sensor]; }
  std::size_t buffers() const noexcept { return sizes_.size(); }
  /// Number of values per row of a buffer.
  std::size_t size(std::size_t buffer) const noexcept { return sizes_[buffer]; }
  static std::size_t channels(std::size_t kind) noexcept {
    return static_cast<std::size_t>(channels_of(static_cast<SensorKind>(kind)));
  }
  bool any(std::size_t kind) const noexcept {
    return std::any_of(groups_.begin(), groups_.end(), [kind](const Group& g) { return g.has(kind); });
  }
  /// True if rendering needs images other than those of the sensors: faces of cubes, coverage of sets,
  /// or depths.
  bool needs_scratch() const noexcept {
    return any(kSemantic) || any(kNormal) ||
           std::any_of(groups_.begin(), groups_.end(), [](const Group& g) { return g.cube != nullptr; });
  }

  /// Appends all cameras of a view, group by group.
  void append_cameras(const Vec3d& base, const Quatd& rotation, double pitch,
                      std::vector<Camera>& out) const {
    for (const Group& g : groups_) {
      const Camera c = sensor_camera(sensors_[g.sensor], base, rotation, pitch);
      if (g.cube == nullptr) {
        out.push_back(c);
        continue;
      }
      for (const std::size_t face : g.cube->faces()) out.push_back(g.cube->face_camera(c, face));
    }
  }

 private:
  Group& group_of(std::size_t sensor) {
    for (Group& g : groups_) {
      if (same_camera(sensors_[g.sensor], sensors_[sensor])) return g;
    }
    Group& group = groups_.emplace_back();
    group.sensor = sensor;
    if (sensors_[sensor].model != SensorModel::pinhole)
      group.cube = std::make_shared<const CubeMap>(sensors_[sensor]);
    return group;
  }
  std::size_t add_buffer(std::size_t sensor) {
    const SensorSpec& s = sensors_[sensor];
    sizes_.push_back(static_cast<std::size_t>(s.resolution[0]) *
                     static_cast<std::size_t>(s.resolution[1]) *
                     static_cast<std::size_t>(channels_of(s.kind)));
    return sizes_.size() - 1;
  }

  std::vector<SensorSpec> sensors_;
  std::vector<Group> groups_;
  std::vector<SensorBuffers> of_sensor_;  // One per sensor.
  std::vector<std::size_t> sizes_;        // One per buffer.
};

}  // namespace gsnav
