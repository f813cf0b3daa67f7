// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/math/similarity.hpp"

namespace gsnav {

/// Local joint rotations and where the root is, relative to rest.
struct Pose {
  std::vector<Quatd> rotations;  ///< [J]
  Vec3d root_translation{};
};

/// A way along the ground walked back and forth at constant speed, turning on the spot at each corner
/// sharper than a few degrees. Continuous in position and heading at all times: nobody teleports.
class WalkTrajectory {
 public:
  /// `points`: world, metres, Y up; `speed` in m/s, `turn_rate` in rad/s. One point stands still.
  explicit WalkTrajectory(std::vector<Vec3d> points = {Vec3d{}}, double speed = 1.0, double turn_rate = 2.5,
                          double start_time = 0.0)
      : start_time_(start_time) {
    std::vector<Vec3d> way;
    for (const Vec3d& p : points) {
      if (way.empty() || norm(p - way.back()) > 1e-6) way.push_back(p);
    }
    if (way.empty()) way.push_back({});
    const std::size_t n = way.size();
    for (std::size_t i = n; i-- > 1;) way.push_back(way[i - 1]);  // and back
    if (n == 1) {
      keys_.push_back({0, 0, way[0], 0});
      return;
    }
    double t = 0, walked = 0;
    double yaw = heading(way[1] - way[0]);
    const double first = yaw;
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const double length = norm(way[i + 1] - way[i]);
      if (i > 0) {
        const double next = nearest(heading(way[i + 1] - way[i]), yaw);
        keys_.push_back({t, walked, way[i], yaw});
        t += std::abs(next - yaw) / turn_rate;
        yaw = next;
      }
      keys_.push_back({t, walked, way[i], yaw});
      t += length / speed;
      walked += length;
    }
    keys_.push_back({t, walked, way.back(), yaw});
    const double end = nearest(first, yaw);
    t += std::abs(end - yaw) / turn_rate;
    keys_.push_back({t, walked, way.back(), end});
  }

  /// Seconds of one round; 0 for somebody who stands.
  double period() const noexcept { return keys_.back().time; }
  /// World from avatar frame (Y up, facing -Z).
  Similarity placement(double t) const noexcept {
    const auto [k, u, round] = at(t);
    (void)round;
    const Key& a = keys_[k];
    const Key& b = keys_[std::min(k + 1, keys_.size() - 1)];
    Similarity s;
    s.rotation = axis_angle(Vec3d{0, 1, 0}, a.yaw + (b.yaw - a.yaw) * u);
    s.translation = lerp(a.position, b.position, u);
    return s;
  }
  /// Metres walked since the start time.
  double distance(double t) const noexcept {
    const auto [k, u, round] = at(t);
    const Key& a = keys_[k];
    const Key& b = keys_[std::min(k + 1, keys_.size() - 1)];
    return round * keys_.back().walked + a.walked + (b.walked - a.walked) * u;
  }
  /// 1 while walking, 0 while standing or turning, with a ramp of 0.3 s.
  double effort(double t) const noexcept {
    if (period() == 0) return 0;
    const double h = 0.15;
    const double moved = distance(t + h) - distance(t - h);
    const double full = 2 * h * speed();
    return std::clamp(moved / full, 0.0, 1.0);
  }

 private:
  struct Key {
    double time, walked;
    Vec3d position;
    double yaw;
  };
  struct Where {
    std::size_t key;
    double u, round;
  };
  static double heading(const Vec3d& d) noexcept { return std::atan2(-d.x, -d.z); }
  static double nearest(double yaw, double to) noexcept {
    const double two_pi = 6.283185307179586;
    return yaw + two_pi * std::round((to - yaw) / two_pi);
  }
  double speed() const noexcept {
    for (std::size_t i = 0; i + 1 < keys_.size(); ++i) {
      const double dt = keys_[i + 1].time - keys_[i].time;
      if (keys_[i + 1].walked > keys_[i].walked && dt > 0) return (keys_[i + 1].walked - keys_[i].walked) / dt;
    }
    return 1;
  }
  Where at(double t) const noexcept {
    if (period() == 0) return {0, 0, 0};
    t -= start_time_;
    const double round = std::floor(t / period());
    t -= round * period();
    std::size_t k = 0;
    while (k + 2 < keys_.size() && keys_[k + 1].time <= t) ++k;
    const double dt = keys_[k + 1].time - keys_[k].time;
    return {k, dt > 0 ? std::clamp((t - keys_[k].time) / dt, 0.0, 1.0) : 0.0, round};
  }
  std::vector<Key> keys_;
  double start_time_;
};

/// Pose of the walking gait: `cycles` counts strides (two steps each), `effort` blends from standing (0)
/// to walking (1). Joints are found by their SMPL-X names; missing ones stay at rest.
inline Pose walk_pose(const Skeleton& skeleton, double cycles, double effort) {
  Pose pose;
  pose.rotations.resize(skeleton.joint_count());
  const double phase = 6.283185307179586 * (cycles - std::floor(cycles));
  const auto turn = [&](std::string_view name, const Vec3d& axis, double angle) {
    for (std::size_t j = 0; j < skeleton.names.size(); ++j) {
      if (skeleton.names[j] == name) pose.rotations[j] = axis_angle(axis, angle) * pose.rotations[j];
    }
  };
  const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  for (const int side : {0, 1}) {
    const char* const hip = side == 0 ? "left_hip" : "right_hip";
    const char* const knee = side == 0 ? "left_knee" : "right_knee";
    const char* const ankle = side == 0 ? "left_ankle" : "right_ankle";
    const char* const shoulder = side == 0 ? "left_shoulder" : "right_shoulder";
    const char* const elbow = side == 0 ? "left_elbow" : "right_elbow";
    const double p = phase + (side == 0 ? 0.0 : 3.14159265358979);
    const double swing = effort * 0.42 * std::sin(p);                       // forward positive
    const double bend = effort * (0.12 + 0.5 * std::pow(std::max(0.0, std::cos(p)), 2.0));
    turn(hip, x, swing);
    turn(knee, x, -bend);
    turn(ankle, x, bend - swing * 0.9);
    // Arms hang (from the T of rest) and swing against the legs.
    turn(shoulder, x, -effort * 0.35 * std::sin(p));
    pose.rotations[0] = pose.rotations[0];
    const double down = side == 0 ? 1.32 : -1.32;
    for (std::size_t j = 0; j < skeleton.names.size(); ++j) {
      if (skeleton.names[j] == shoulder) pose.rotations[j] = pose.rotations[j] * axis_angle(z, down);
      if (skeleton.names[j] == elbow) {
        pose.rotations[j] = axis_angle(y, (side == 0 ? -1.0 : 1.0) * (0.25 + 0.15 * effort));
      }
    }
  }
  turn("spine2", y, effort * 0.08 * std::sin(phase));
  pose.root_translation.y = -effort * 0.02 * (1 - std::cos(2 * phase)) * 0.5 - effort * 0.015;
  return pose;
}

}  // namespace gsnav
