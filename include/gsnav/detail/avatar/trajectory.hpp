// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Where an actor stands at one time. World frame: Y up, metres; it faces -Z turned by `yaw` about +Y.
struct TrajectorySample {
  Vec3d position{};       ///< Place on the floor, metres.
  double yaw = 0.0;       ///< radians, positive to the left
  double distance = 0.0;  ///< metres walked since time 0
  /// Distances at which the present walk began and will end with a stop; infinite where there is none.
  double leg_begin = -std::numeric_limits<double>::infinity();
  /// Distance at which the walk ends with a stop, metres; infinity if it does not.
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;   ///< radians turned on the spot since time 0
  double walking = 0.0;  ///< speed as a share of the walking speed
  double turning = 0.0;  ///< how much of a turn on the spot is going on, [0, 1]
};

/// A path over time. Implementations are immutable and continuous in time.
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  /// `t`: seconds since the actor appeared; any finite value.
  virtual TrajectorySample at(double t) const = 0;
};

/// Stands in one place.
class StandingTrajectory final : public Trajectory {
 public:
  /// Stands at `position` (metres), turned by `yaw` (radians).
  explicit StandingTrajectory(const Vec3d& position = {}, double yaw = 0.0);
  TrajectorySample at(double) const override { return sample_; }

 private:
  TrajectorySample sample_;
};

/// How an actor walks along a path.
struct WalkOptions {
  double speed = 1.2;            ///< metres a second along the path, > 0
  double acceleration = 2.0;     ///< metres a second squared at stops, > 0
  double turn_rate = 2.5;        ///< mean radians a second of a turn on the spot, > 0
  double heading_window = 0.35;  ///< metres before and after a corner over which the heading turns
  double stop_angle = 1.75;      ///< radians: a sharper corner is turned on the spot
  bool closed = false;           ///< from the last point on to the first, else back and forth
  double start = 0.0;            ///< seconds into the round at time 0
};

/// Walks a polyline for ever, back and forth or round and round. The position never leaves the polyline
/// (a path on a NavMesh stays on it) and never jumps; the heading is the path's direction averaged over
/// a window, so that it turns at a bounded rate; at the ends and at sharp corners the walker slows down,
/// turns on the spot and goes on.
class WalkTrajectory final : public Trajectory {
 public:
  /// `points`: metres, on the ground. Fewer than two distinct ones: stands on the first.
  /// Errors: invalid_argument (no point, not finite, a rate that is not positive).
  static Result<WalkTrajectory> create(const std::vector<Vec3d>& points,
                                       const WalkOptions& options = {});

  /// Seconds of one round; 0 for a walker that stands.
  double period() const noexcept { return period_; }
  /// Metres of one round.
  double length() const noexcept { return length_; }
  /// Seconds from the first point to the last of a path that is not closed, turns on the spot between
  /// them included; the period of one that is, 0 for a walker that stands.
  double arrival() const noexcept;

  TrajectorySample at(double t) const override;

 private:
  // A stretch without a stop, followed by a turn on the spot.
  struct Leg {
    std::vector<Vec3d> points;
    std::vector<double> at;       // metres along the leg, one a point
    std::vector<double> heading;  // one a segment, without jumps of 2 pi
    double length = 0, begin = 0, walk_time = 0, turn_time = 0, peak = 0, turn = 0, yaw_end = 0;
    double distance = 0, turned = 0;  // at its begin
  };

  void build(const std::vector<Vec3d>& raw);

  double corner(const Vec3d& a, const Vec3d& b, const Vec3d& c) const noexcept;

  void build_closed(std::vector<Vec3d> path);

  void cut(const std::vector<Vec3d>& path);

  void add_leg(const std::vector<Vec3d>& points);

  void finish();

  // Integral of the heading over [0, s] of a leg; headings go on beyond its ends (for an endless round
  // with the round's turn added).
  double heading_integral(const Leg& leg, double s) const noexcept;

  double heading(const Leg& leg, double s) const noexcept;

  static Vec3d place(const Leg& leg, double s) noexcept;

  TrajectorySample sample(double t) const;

  WalkOptions options_;
  std::vector<Leg> legs_;
  std::size_t one_way_ = 0;  // legs of a path that is not closed until it is walked back
  TrajectorySample standing_;
  double period_ = 0, length_ = 0, turned_ = 0, loop_turn_ = 0;
  bool endless_ = false;
};

}  // namespace gsnav
