// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Where an actor is at one time. World frame: Y up, metres. The actor faces -Z turned by `yaw` about
/// +Y.
struct TrajectorySample {
  Vec3d position{};       ///< Metres, on the ground.
  double yaw = 0.0;       ///< Radians, positive to the left.
  double distance = 0.0;  ///< Metres walked since time 0.
  /// Distance at which the present walk began, metres; -infinity if it had no start.
  double leg_begin = -std::numeric_limits<double>::infinity();
  /// Distance at which it will stop, metres; infinity if it has no end.
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;   ///< Radians turned on the spot since time 0.
  double walking = 0.0;  ///< Speed as a share of the walking speed.
  double turning = 0.0;  ///< Weight of turning on the spot, in [0, 1].
};

/// A path over time. Implementations are immutable and continuous in time.
class Trajectory {
 public:
  virtual ~Trajectory() = default;  ///< Virtual, so that paths can be deleted as Trajectory.
  /// State at time t, in seconds since the actor appeared; any finite value.
  virtual TrajectorySample at(double t) const = 0;
};

/// Stands in one place.
class StandingTrajectory final : public Trajectory {
 public:
  /// Stands at `position` (metres), facing `yaw` (radians).
  explicit StandingTrajectory(const Vec3d& position = {}, double yaw = 0.0);
  TrajectorySample at(double) const override { return sample_; }

 private:
  TrajectorySample sample_;
};

/// Settings of WalkTrajectory.
struct WalkOptions {
  double speed = 1.2;            ///< Walking speed along the path, m/s, > 0.
  double acceleration = 2.0;     ///< Acceleration and braking at stops, m/s^2, > 0.
  double turn_rate = 2.5;        ///< Mean speed of a turn on the spot, rad/s, > 0.
  double heading_window = 0.35;  ///< Metres before and after a corner over which the heading turns.
  double stop_angle = 1.75;      ///< Radians. At a sharper corner the walker stops and turns on the
                                 ///< spot.
  bool closed = false;           ///< Whether the path leads from the last point to the first, or back
                                 ///< and forth.
  double start = 0.0;            ///< Seconds into the round at time 0.
};

/// Walks along a polyline for ever, back and forth or in a closed loop. The position never leaves the
/// polyline (so a path on a NavMesh stays on it) and never jumps. The heading is the direction of the
/// path averaged over a window, so that it turns at a bounded rate. At the ends and at sharp corners the
/// walker slows down, turns on the spot and walks on.
class WalkTrajectory final : public Trajectory {
 public:
  /// Makes a walk.
  /// @param points metres, on the ground. With fewer than two distinct points the walker stands on the
  /// first.
  /// @return the walk, or invalid_argument (no point, a point that is not finite, a rate that is not
  /// positive).
  static Result<WalkTrajectory> create(const std::vector<Vec3d>& points,
                                       const WalkOptions& options = {});

  /// Seconds of one round; 0 if the walker stands.
  double period() const noexcept { return period_; }
  /// Metres of one round.
  double length() const noexcept { return length_; }
  /// Seconds from the first point to the last, with turns on the spot in between. The period for a
  /// closed path; 0 if the walker stands.
  double arrival() const noexcept;

  TrajectorySample at(double t) const override;

 private:
  // A stretch without a stop, followed by a turn on the spot.
  struct Leg {
    std::vector<Vec3d> points;
    std::vector<double> at;       // metres along the leg, one for each point
    std::vector<double> heading;  // radians, one for each segment, without jumps of 2 pi
    double length = 0, begin = 0, walk_time = 0, turn_time = 0, peak = 0, turn = 0, yaw_end = 0;
    double distance = 0, turned = 0;  // when the leg begins
  };

  void build(const std::vector<Vec3d>& raw);

  double corner(const Vec3d& a, const Vec3d& b, const Vec3d& c) const noexcept;

  void build_closed(std::vector<Vec3d> path);

  void split(const std::vector<Vec3d>& path);

  void add_leg(const std::vector<Vec3d>& points);

  void finish();

  // Integral of the heading over [0, s] of a leg. The heading continues beyond the leg's ends; in an
  // endless round, with the turn of a whole round added.
  double heading_integral(const Leg& leg, double s) const noexcept;

  double heading(const Leg& leg, double s) const noexcept;

  static Vec3d place(const Leg& leg, double s) noexcept;

  TrajectorySample sample(double t) const;

  WalkOptions options_;
  std::vector<Leg> legs_;
  std::size_t one_way_ = 0;  // number of legs of an open path until it is walked back
  TrajectorySample standing_;
  double period_ = 0, length_ = 0, turned_ = 0, loop_turn_ = 0;
  bool endless_ = false;
};

}  // namespace gsnav
