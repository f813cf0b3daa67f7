// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/quat.hpp"
#include "gsnav/math/vec.hpp"

namespace gsnav {

/// Where an actor stands at one time. World frame: Y up, metres; it faces -Z turned by `yaw` about +Y.
struct TrajectorySample {
  Vec3d position{};
  double yaw = 0.0;       ///< radians, positive to the left
  double distance = 0.0;  ///< metres walked since time 0
  /// Distances at which the present walk began and will end with a stop; infinite where there is none.
  double leg_begin = -std::numeric_limits<double>::infinity();
  double leg_end = std::numeric_limits<double>::infinity();
  double turned = 0.0;    ///< radians turned on the spot since time 0
  double walking = 0.0;   ///< speed as a share of the walking speed
  double turning = 0.0;   ///< how much of a turn on the spot is going on, [0, 1]
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
  explicit StandingTrajectory(const Vec3d& position = {}, double yaw = 0.0) {
    sample_.position = position;
    sample_.yaw = yaw;
  }
  TrajectorySample at(double) const override { return sample_; }

 private:
  TrajectorySample sample_;
};

struct WalkOptions {
  double speed = 1.2;               ///< metres a second along the path, > 0
  double acceleration = 2.0;        ///< metres a second squared at stops, > 0
  double turn_rate = 2.5;           ///< mean radians a second of a turn on the spot, > 0
  double heading_window = 0.35;     ///< metres before and after a corner over which the heading turns
  double stop_angle = 1.75;         ///< radians: a sharper corner is turned on the spot
  bool closed = false;              ///< from the last point on to the first, else back and forth
  double start = 0.0;               ///< seconds into the round at time 0
};

/// Walks a polyline for ever, back and forth or round and round. The position never leaves the polyline
/// (a path on a NavMesh stays on it) and never jumps; the heading is the path's direction averaged over a
/// window, so that it turns at a bounded rate; at the ends and at sharp corners the walker slows down,
/// turns on the spot and goes on.
class WalkTrajectory final : public Trajectory {
 public:
  /// `points`: metres, on the ground. Fewer than two distinct ones: stands on the first.
  /// Errors: invalid_argument (no point, not finite, a rate that is not positive).
  static Result<WalkTrajectory> create(const std::vector<Vec3d>& points, const WalkOptions& options = {}) {
    const auto bad = [](const char* what) { return Status(Errc::invalid_argument, what); };
    if (points.empty()) return bad("WalkTrajectory: no points");
    for (const Vec3d& p : points) {
      if (!is_finite(p)) return bad("WalkTrajectory: a point is not finite");
    }
    const auto positive = [](double v) { return v > 0 && is_finite(v); };
    if (!positive(options.speed)) return bad("WalkOptions.speed must be positive");
    if (!positive(options.acceleration)) return bad("WalkOptions.acceleration must be positive");
    if (!positive(options.turn_rate)) return bad("WalkOptions.turn_rate must be positive");
    if (!positive(options.heading_window)) return bad("WalkOptions.heading_window must be positive");
    if (!(options.stop_angle > 0)) return bad("WalkOptions.stop_angle must be positive");
    if (!is_finite(options.start)) return bad("WalkOptions.start must be finite");
    WalkTrajectory w;
    w.options_ = options;
    w.build(points);
    return w;
  }

  /// Seconds of one round; 0 for a walker that stands.
  double period() const noexcept { return period_; }
  /// Metres of one round.
  double length() const noexcept { return length_; }
  /// Seconds from the first point to the last of a path that is not closed, turns on the spot between them included;
  /// the period of one that is, 0 for a walker that stands.
  double arrival() const noexcept {
    return one_way_ == 0 ? period_ : legs_[one_way_ - 1].begin + legs_[one_way_ - 1].walk_time;
  }

  TrajectorySample at(double t) const override {
    if (legs_.empty()) return standing_;
    TrajectorySample s = sample(t + options_.start), first = sample(options_.start);
    s.distance -= first.distance;
    s.leg_begin -= first.distance;
    s.leg_end -= first.distance;
    s.turned -= first.turned;
    return s;
  }

 private:
  // A stretch without a stop, followed by a turn on the spot.
  struct Leg {
    std::vector<Vec3d> points;
    std::vector<double> at;        // metres along the leg, one a point
    std::vector<double> heading;   // one a segment, without jumps of 2 pi
    double length = 0, begin = 0, walk_time = 0, turn_time = 0, peak = 0, turn = 0, yaw_end = 0;
    double distance = 0, turned = 0;  // at its begin
  };

  static double wrapped(double angle) noexcept { return std::remainder(angle, 6.283185307179586); }
  static double heading_of(const Vec3d& d) noexcept { return std::atan2(-d.x, -d.z); }
  static bool flat(const Vec3d& d) noexcept { return std::hypot(d.x, d.z) < 0.01; }

  void build(const std::vector<Vec3d>& raw) {
    std::vector<Vec3d> path;
    for (const Vec3d& p : raw) {
      if (path.empty() || !flat(p - path.back())) path.push_back(p);
    }
    if (options_.closed && path.size() > 1 && flat(path.front() - path.back())) path.pop_back();
    standing_.position = path.front();
    if (path.size() < 2) return;
    if (options_.closed && path.size() > 2) {
      build_closed(path);
    } else {
      std::vector<Vec3d> back(path.rbegin(), path.rend());
      cut(path);
      one_way_ = legs_.size();
      cut(back);
    }
    finish();
  }

  double corner(const Vec3d& a, const Vec3d& b, const Vec3d& c) const noexcept {
    return abs(wrapped(heading_of(c - b) - heading_of(b - a)));
  }

  void build_closed(std::vector<Vec3d> path) {
    const std::size_t n = path.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (corner(path[(i + n - 1) % n], path[i], path[(i + 1) % n]) > options_.stop_angle) {
        std::vector<Vec3d> open;
        for (std::size_t k = 0; k <= n; ++k) open.push_back(path[(i + k) % n]);
        cut(open);
        return;
      }
    }
    // No stop anywhere: the round begins in the middle of a segment.
    endless_ = true;
    const Vec3d middle = lerp(path[0], path[1], 0.5);
    std::vector<Vec3d> round{middle};
    for (std::size_t k = 1; k <= n; ++k) round.push_back(path[k % n]);
    round.push_back(middle);
    add_leg(round);
  }

  void cut(const std::vector<Vec3d>& path) {
    std::vector<Vec3d> leg{path[0]};
    for (std::size_t i = 1; i < path.size(); ++i) {
      leg.push_back(path[i]);
      if (i + 1 == path.size() || corner(path[i - 1], path[i], path[i + 1]) > options_.stop_angle) {
        add_leg(leg);
        leg = {path[i]};
      }
    }
  }

  void add_leg(const std::vector<Vec3d>& points) {
    Leg leg;
    leg.points = points;
    leg.at.push_back(0.0);
    for (std::size_t i = 1; i < points.size(); ++i) {
      const Vec3d d = points[i] - points[i - 1];
      leg.at.push_back(leg.at.back() + norm(d));
      double h = heading_of(d);
      if (i > 1) h = leg.heading.back() + wrapped(h - leg.heading.back());
      leg.heading.push_back(h);
    }
    leg.length = leg.at.back();
    legs_.push_back(std::move(leg));
  }

  void finish() {
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      Leg& leg = legs_[i];
      leg.begin = period_;
      leg.distance = length_;
      leg.turned = turned_;
      if (endless_) {
        leg.walk_time = leg.length / options_.speed;
        loop_turn_ = leg.heading.front() - leg.heading.back();
        loop_turn_ = leg.heading.back() + wrapped(loop_turn_) - leg.heading.front();
      } else {
        // Up to speed, on, and down again; a short leg never gets to full speed.
        leg.peak = min(options_.speed, sqrt(options_.acceleration * leg.length));
        leg.walk_time = leg.length / leg.peak + leg.peak / options_.acceleration;
        const Leg& next = legs_[(i + 1) % legs_.size()];
        leg.yaw_end = heading(leg, leg.length);
        leg.turn = wrapped(heading(next, 0.0) - leg.yaw_end);
        leg.turn_time = abs(leg.turn) / options_.turn_rate;
      }
      period_ += leg.walk_time + leg.turn_time;
      length_ += leg.length;
      turned_ += abs(leg.turn);
    }
  }

  // Integral of the heading over [0, s] of a leg; headings go on beyond its ends (for an endless round
  // with the round's turn added).
  double heading_integral(const Leg& leg, double s) const noexcept {
    if (s < 0) {
      if (!endless_) return s * leg.heading.front();
      return heading_integral(leg, s + leg.length) - heading_integral(leg, leg.length) - s * loop_turn_;
    }
    if (s > leg.length) {
      const double whole = heading_integral(leg, leg.length), over = s - leg.length;
      if (!endless_) return whole + over * leg.heading.back();
      return whole + heading_integral(leg, over) + over * loop_turn_;
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < leg.heading.size() && leg.at[i] < s; ++i) {
      sum += leg.heading[i] * (min(s, leg.at[i + 1]) - leg.at[i]);
    }
    return sum;
  }

  double heading(const Leg& leg, double s) const noexcept {
    const double w = min(options_.heading_window, 0.5 * leg.length);
    return (heading_integral(leg, s + w) - heading_integral(leg, s - w)) / (2 * w);
  }

  static Vec3d place(const Leg& leg, double s) noexcept {
    std::size_t i = 1;
    while (i + 1 < leg.at.size() && leg.at[i] < s) ++i;
    return lerp(leg.points[i - 1], leg.points[i], clamp((s - leg.at[i - 1]) / (leg.at[i] - leg.at[i - 1]), 0.0, 1.0));
  }

  TrajectorySample sample(double t) const {
    const double rounds = std::floor(t / period_);
    t -= rounds * period_;
    std::size_t i = legs_.size() - 1;
    while (i > 0 && legs_[i].begin > t) --i;
    const Leg& leg = legs_[i];
    t -= leg.begin;
    TrajectorySample out;
    double s = leg.length;
    out.yaw = leg.yaw_end;
    out.turned = leg.turned + rounds * turned_;
    if (endless_) {
      s = min(options_.speed * t, leg.length);
      out.walking = 1.0;
      out.yaw = heading(leg, s);
    } else if (t < leg.walk_time) {
      const double a = options_.acceleration, v = leg.peak, left = leg.walk_time - t;
      const double ramp = v / a;
      if (t < ramp) {
        s = 0.5 * a * t * t;
      } else if (left < ramp) {
        s = leg.length - 0.5 * a * left * left;
      } else {
        s = 0.5 * v * ramp + v * (t - ramp);
      }
      out.walking = min(min(t, left) * a, v) / options_.speed;
      out.yaw = heading(leg, s);
    } else if (leg.turn_time > 0) {
      const double u = clamp((t - leg.walk_time) / leg.turn_time, 0.0, 1.0);
      const double eased = u * u * (3 - 2 * u);
      out.yaw += leg.turn * eased;
      out.turned += abs(leg.turn) * eased;
      out.turning = min(1.0, min(u, 1 - u) * leg.turn_time / 0.15) * min(1.0, abs(leg.turn));
    }
    out.position = place(leg, s);
    out.yaw = wrapped(out.yaw);
    const double begin = leg.distance + rounds * length_;
    out.distance = begin + s;
    if (!endless_) {
      out.leg_begin = begin;
      out.leg_end = begin + leg.length;
    }
    return out;
  }

  WalkOptions options_;
  std::vector<Leg> legs_;
  std::size_t one_way_ = 0;  // legs of a path that is not closed until it is walked back
  TrajectorySample standing_;
  double period_ = 0, length_ = 0, turned_ = 0, loop_turn_ = 0;
  bool endless_ = false;
};

}  // namespace gsnav
