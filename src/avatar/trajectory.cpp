// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/trajectory.hpp"

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "gsnav/detail/math/easing.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

namespace {

bool flat(const Vec3d& d) noexcept { return std::hypot(d.x, d.z) < 0.01; }

}  // namespace

StandingTrajectory::StandingTrajectory(const Vec3d& position, double yaw) {
  sample_.position = position;
  sample_.yaw = yaw;
}

Result<WalkTrajectory> WalkTrajectory::create(const std::vector<Vec3d>& points,
                                              const WalkOptions& options) {
  const auto bad = [](const char* what) { return Status(Errc::invalid_argument, what); };
  if (points.empty()) return bad("WalkTrajectory: no points");
  for (const Vec3d& p : points) {
    if (!is_finite(p)) return bad("WalkTrajectory: a point is not finite");
  }
  detail::FieldCheck check("WalkOptions.");
  check.positive("speed", options.speed).positive("acceleration", options.acceleration);
  check.positive("turn_rate", options.turn_rate).positive("heading_window", options.heading_window);
  check.need(options.stop_angle > 0, "stop_angle", options.stop_angle, "must be positive");
  if (!check.finite("start", options.start).status()) return check.status();
  WalkTrajectory w;
  w.options_ = options;
  w.build(points);
  return w;
}

double WalkTrajectory::arrival() const noexcept {
  return one_way_ == 0 ? period_ : legs_[one_way_ - 1].begin + legs_[one_way_ - 1].walk_time;
}

TrajectorySample WalkTrajectory::at(double t) const {
  if (legs_.empty()) return standing_;
  TrajectorySample s = sample(t + options_.start), first = sample(options_.start);
  s.distance -= first.distance;
  s.leg_begin -= first.distance;
  s.leg_end -= first.distance;
  s.turned -= first.turned;
  return s;
}

void WalkTrajectory::build(const std::vector<Vec3d>& raw) {
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
    split(path);
    one_way_ = legs_.size();
    split(back);
  }
  finish();
}

double WalkTrajectory::corner(const Vec3d& a, const Vec3d& b, const Vec3d& c) const noexcept {
  return abs(wrapped(heading_of(c - b) - heading_of(b - a)));
}

void WalkTrajectory::build_closed(std::vector<Vec3d> path) {
  const std::size_t n = path.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (corner(path[(i + n - 1) % n], path[i], path[(i + 1) % n]) > options_.stop_angle) {
      std::vector<Vec3d> open;
      for (std::size_t k = 0; k <= n; ++k) open.push_back(path[(i + k) % n]);
      split(open);
      return;
    }
  }
  // No stop anywhere: begin the round in the middle of a segment.
  endless_ = true;
  const Vec3d middle = lerp(path[0], path[1], 0.5);
  std::vector<Vec3d> round{middle};
  for (std::size_t k = 1; k <= n; ++k) round.push_back(path[k % n]);
  round.push_back(middle);
  add_leg(round);
}

void WalkTrajectory::split(const std::vector<Vec3d>& path) {
  std::vector<Vec3d> leg{path[0]};
  for (std::size_t i = 1; i < path.size(); ++i) {
    leg.push_back(path[i]);
    if (i + 1 == path.size() || corner(path[i - 1], path[i], path[i + 1]) > options_.stop_angle) {
      add_leg(leg);
      leg = {path[i]};
    }
  }
}

void WalkTrajectory::add_leg(const std::vector<Vec3d>& points) {
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

void WalkTrajectory::finish() {
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
      // Accelerate, walk, decelerate. On a short leg the walker never reaches full speed.
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

double WalkTrajectory::heading_integral(const Leg& leg, double s) const noexcept {
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

double WalkTrajectory::heading(const Leg& leg, double s) const noexcept {
  const double w = min(options_.heading_window, 0.5 * leg.length);
  return (heading_integral(leg, s + w) - heading_integral(leg, s - w)) / (2 * w);
}

Vec3d WalkTrajectory::place(const Leg& leg, double s) noexcept {
  std::size_t i = 1;
  while (i + 1 < leg.at.size() && leg.at[i] < s) ++i;
  return lerp(leg.points[i - 1], leg.points[i],
              clamp((s - leg.at[i - 1]) / (leg.at[i] - leg.at[i - 1]), 0.0, 1.0));
}

TrajectorySample WalkTrajectory::sample(double t) const {
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
    const double eased = smoothstep(u);
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

}  // namespace gsnav
