// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/demo/gait.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gsnav/detail/core/field_check.hpp"
#include "gsnav/detail/math/angles.hpp"
#include "gsnav/detail/math/easing.hpp"

namespace gsnav {

namespace {

// How far the pelvis moves in a walk, metres: to each side, and up and down.
constexpr double kSway = 0.018, kBob = 0.020;
constexpr double kStand = 0.012;  // keeps knees from locking, metres

Quatd about_x(double degrees) noexcept { return axis_angle(Vec3d{1, 0, 0}, degrees * kTwoPi / 360); }
Quatd about_y(double degrees) noexcept { return axis_angle(Vec3d{0, 1, 0}, degrees * kTwoPi / 360); }
Quatd about_z(double degrees) noexcept { return axis_angle(Vec3d{0, 0, 1}, degrees * kTwoPi / 360); }

double smooth(double u) noexcept { return smoothstep(clamp(u, 0.0, 1.0)); }

// The rotation that takes the bind pose's bone direction `from` to `to`, and the bind pose's +X, made
// perpendicular to the bone, to `hinge`.
Quatd align(const Vec3d& from, const Vec3d& to, const Vec3d& hinge) {
  const auto frame = [](const Vec3d& bone, const Vec3d& x) {
    const Vec3d d = normalized(bone), h = normalized(x - d * dot(x, d));
    return Mat3d{{h, d, cross(h, d)}};
  };
  return quat_from_matrix(transpose(frame(to, hinge)) * frame(from, {1, 0, 0}));
}

}  // namespace

Result<WalkMotion> WalkMotion::create(const Skeleton& skeleton, const GaitOptions& options) {
  if (Status s = skeleton.validate(); !s) return s;
  WalkMotion m;
  m.options_ = options;
  m.parents_ = skeleton.parents;
  m.rest_ = skeleton.rest_pose();
  static constexpr const char* kNames[kBodyJoints] = {
      "pelvis",      "spine1",        "spine2",      "spine3",     "neck",         "head",
      "right_hip",   "right_knee",    "right_ankle", "right_foot", "right_collar", "right_shoulder",
      "right_elbow", "right_wrist",   "left_hip",    "left_knee",  "left_ankle",   "left_foot",
      "left_collar", "left_shoulder", "left_elbow",  "left_wrist"};
  for (std::size_t k = 0; k < kBodyJoints; ++k) {
    const int j = skeleton.find(kNames[k]);
    if (j < 0)
      return Status(Errc::invalid_argument, std::string("WalkMotion: no joint called ") + kNames[k]);
    m.joints_[k] = static_cast<std::size_t>(j);
  }
  detail::FieldCheck check("GaitOptions.");
  check.need(options.duty > 0.5 && options.duty < 0.75, "duty", options.duty, "must be in (0.5, 0.75)");
  check.positive("speed", options.speed).not_negative("stride", options.stride);
  check.finite("arm_swing", options.arm_swing).finite("start_phase", options.start_phase);
  if (!check.status()) return check.status();
  for (const auto& g : skeleton.rest_globals()) {
    m.rest_globals_.push_back({quat_from_matrix(g.linear), g.translation});
  }
  for (std::size_t j = 0; j < skeleton.size(); ++j) {
    const std::string& n = skeleton.names[j];
    const bool finger = n.find("index") != n.npos || n.find("middle") != n.npos ||
                        n.find("ring") != n.npos || n.find("pinky") != n.npos;
    const double curl = !finger ? 0.0 : (n.compare(0, 4, "left") == 0 ? 16.0 : -16.0);
    m.curls_.push_back(finger ? 1 : 0);
    m.curl_.push_back(about_z(curl));
  }
  m.prepare();
  return m;
}

void WalkMotion::pose_of(const MotionInput& input, const std::vector<char>& needed,
                         LocalPose& out) const {
  Steps steps;
  steps.stride = stride_;
  const double length = input.leg_end - input.leg_begin;
  if (is_finite(length) && length > 0) {
    steps.stride = 2 * length / std::ceil(length / (0.5 * stride_));
    steps.gone = input.distance - input.leg_begin;
    steps.left = input.leg_end - input.distance;
    // Start with the right foot in the air and the left one below the body.
    steps.cycles = 0.5 + upright() + steps.gone / steps.stride;
  } else {
    steps.cycles = options_.start_phase + input.distance / stride_;
  }
  steps.turn_cycles = input.turned / 2.1;  // one step for 60 degrees
  steps.turning = input.turning;
  // The body sways fully from half the speed on, since steps keep their length.
  const double slow = 1.0 - clamp(input.walking, 0.0, 1.0);
  pose(steps, 1.0 - slow * slow * slow, input.time, needed, out);
}

void WalkMotion::pose(double cycles, double walking, double time, LocalPose& out) const {
  Steps steps{.cycles = cycles, .stride = walking * stride_};
  pose(steps, walking, time, {}, out);
}

void WalkMotion::pose(const Steps& steps, double walking, double time, const std::vector<char>& needed,
                      LocalPose& out) const {
  const double cycles = steps.cycles;
  const double phase = cycles - std::floor(cycles);
  // Rotation of each joint from the bind pose, and from joint to root frame.
  thread_local std::vector<Quatd> turn, global;
  thread_local std::vector<char> set;
  turn.resize(parents_.size());
  global.resize(parents_.size());
  set.assign(parents_.size(), 0);
  const PelvisPose b = body(phase, walking, pelvis_drop_);
  out.translations = rest_.translations;
  out.translations[at(kPelvis)] = b.pelvis;
  out.root = {};

  // Each joint first follows its parent as in the bind pose.
  const auto give = [&](std::size_t joint, const Quatd& q) {
    turn[joint] = q;
    set[joint] = 1;
  };
  give(at(kPelvis), b.rotation);
  const double c = std::cos(kTwoPi * phase), breath = std::sin(1.5 * time);
  const double lean = -4.0 * walking + 0.4 * breath;
  Quatd chest = b.rotation;
  for (int k = 0; k < 3; ++k) {
    // Turn against the pelvis: undo its roll and reverse its yaw.
    chest = chest * (about_y(-11.0 / 3 * walking * c) * about_z(-b.roll / 3) * about_x(lean / 3));
    give(at(kSpine1 + k), chest);
  }
  const Quatd level{};
  give(at(kNeck), slerp(chest, level, 0.5));
  give(at(kHead), slerp(chest, level, 0.9));
  for (int side = 0; side < 2; ++side) {
    const double s = side == 0 ? 1.0 : -1.0;
    const int first = side == 0 ? kRightHip : kLeftHip;
    const FootPose f = foot(side, steps, walking);
    const LegPose leg = solve(side, b, f);
    give(at(first), leg.thigh);
    give(at(first + 1), leg.shin);
    give(at(first + 2), about_x(f.pitch));
    give(at(first + 3), about_x(f.pitch + f.toe));

    const double swing = 2.0 - s * options_.arm_swing * walking * c + 0.5 * breath * (1 - walking);
    const double flex = 13.0 + walking * (7.0 + 0.35 * max(swing, -12.0));
    const Arm& arm = arms_[side];
    give(at(first + 4), chest * arm.collar);
    const Quatd upper = chest * about_x(swing) * arm.hang;
    give(at(first + 5), upper);
    give(at(first + 6), chest * about_x(swing + flex) * arm.elbow * arm.hang);
    give(at(first + 7), turn[at(first + 6)] * arm.wrist);
  }
  out.rotations.resize(parents_.size());
  for (std::size_t j = 0; j < parents_.size(); ++j) {
    if (!needed.empty() && needed[j] == 0) continue;
    const std::int32_t p = parents_[j];
    const Quatd above = p < 0 ? Quatd{} : turn[static_cast<std::size_t>(p)];
    if (set[j] == 0) turn[j] = curls_[j] != 0 ? above * curl_[j] : above;
    global[j] = turn[j] * rest_globals_[j].rotation;
    const Quatd parent = p < 0 ? Quatd{} : global[static_cast<std::size_t>(p)];
    out.rotations[j] = conjugate(parent) * global[j];
    normalize(out.rotations[j]);
  }
}

void WalkMotion::prepare() {
  const double height = rest(kHead).y / 0.894;  // the head's joint is at the base of the skull
  stride_ =
      options_.stride > 0 ? options_.stride : height * clamp(0.43 + 0.27 * options_.speed, 0.45, 0.9);
  for (int side = 0; side < 2; ++side) {
    const int first = side == 0 ? kRightHip : kLeftHip;
    const Vec3d arm = rest(first + 6) - rest(first + 5);
    // Rotation from the bind pose to an arm that hangs 8 degrees away from the body.
    const double s = side == 0 ? 1.0 : -1.0,
                 hang = -(82.0 - std::atan2(-arm.y, abs(arm.x)) * 360 / kTwoPi);
    arms_[side] = {about_z(0.12 * s * hang), about_z(s * hang), about_z(-2.0 * s), about_x(4.0)};
    const Vec3d ankle = rest(first + 2), ball = rest(first + 3);
    // Pivots of the foot: the joint of the toes, so that the toes stay flat on the floor, and the edge
    // of the heel.
    ball_[side] = {0, ball.y - ankle.y, ball.z - ankle.z};
    heel_[side] = {0, -ankle.y, 0.40 * (ankle.z - ball.z)};
  }
  // Find the highest pelvis for which no leg must be longer than it is.
  double low = 0.0, high = 0.25 * height;
  for (int i = 0; i < 40; ++i) {
    const double drop = 0.5 * (low + high);
    double stretch = 0.0;
    for (int k = 0; k < 64; ++k) {
      const double phase = k / 64.0;
      const PelvisPose b = body(phase, 1.0, drop);
      for (int side = 0; side < 2; ++side) {
        Steps steps{.cycles = phase, .stride = stride_};
        stretch = max(stretch, solve(side, b, foot(side, steps, 1.0)).stretch);
      }
    }
    (stretch > 0.998 ? low : high) = drop;
  }
  pelvis_drop_ = high;

  // Rotations keep the length of bones. Only the pelvis is translated: to the side, up and down, and by
  // the drop (body()).
  const double moved = norm(Vec3d{kSway, kBob + max(kStand, pelvis_drop_), 0});
  joint_ball_ = {rest(kPelvis), 0.0};
  std::vector<double> away;  // of each joint from the centre, at most
  for (std::size_t j = 0; j < parents_.size(); ++j) {
    const std::int32_t p = parents_[j];
    const double bone = p < 0 ? norm(rest_.translations[j] - joint_ball_.center)
                              : away[static_cast<std::size_t>(p)] + norm(rest_.translations[j]);
    away.push_back(bone + (j == at(kPelvis) ? moved : 0.0));
    joint_ball_.radius = max(joint_ball_.radius, away.back() + 1e-6);
  }
}

WalkMotion::PelvisPose WalkMotion::body(double phase, double walking, double drop) const {
  PelvisPose b;
  const double mid = 0.5 * options_.duty;  // phase at which the right leg is upright
  b.roll = 3.0 * walking * std::cos(kTwoPi * (phase - mid));
  b.rotation =
      about_y(6.0 * walking * std::cos(kTwoPi * phase)) * about_z(b.roll) * about_x(-2.0 * walking);
  const double bob = kBob * walking * std::cos(2 * kTwoPi * (phase - mid + 0.03));
  b.pelvis = rest(kPelvis) + Vec3d{kSway * walking * std::cos(kTwoPi * (phase - mid)),
                                   bob - kStand - walking * (drop - kStand), 0};
  return b;
}

double WalkMotion::stance_pitch(double p, double walking) const noexcept {
  const double rise = max((p - 0.36) / (options_.duty - 0.36), 0.0);
  return walking * (20.0 * (1 - smooth(p / 0.10)) - 52.0 * rise * rise);
}

Vec3d WalkMotion::ankle(int side, double forward, double pitch) const {
  Vec3d a = rest((side == 0 ? kRightHip : kLeftHip) + 2);
  a.x *= 0.85;
  a.z -= forward;
  const Vec3d pivot = pitch > 0 ? heel_[side] : ball_[side];
  return a + pivot - rotate(about_x(pitch), pivot);
}

WalkMotion::FootPose WalkMotion::foot(int side, const Steps& s, double walking) const {
  double p = s.cycles + (side == 0 ? 0.0 : 0.5);
  p -= std::floor(p);
  const double duty = options_.duty;
  // Positions of the present or last footfall and of the next, never before the start nor beyond the
  // stop.
  const double here = clamp(s.stride * (upright() - p), -s.gone, s.left);
  const double next = clamp(s.stride * (upright() - p + 1), -s.gone, s.left);
  FootPose f;
  if (p < duty) {
    f.pitch = stance_pitch(p, walking);
    f.ankle = ankle(side, here, f.pitch);
    f.toe = max(-f.pitch, 0.0);
  } else {
    // Swing: from where the toes leave to where the heel will strike, matching the foot's velocity at
    // both ends. After a start or before a stop only a part of the swing happens.
    const double span = 1 - duty;
    double from = 0.0, to = 1.0;
    if (s.stride > 0) {
      from = max(0.0, (p - s.gone / s.stride - duty) / span);
      to = min(1.0, (p + s.left / s.stride - duty) / span);
    }
    const double u = to > from ? clamp(((p - duty) / span - from) / (to - from), 0.0, 1.0) : 1.0;
    const double u2 = u * u, u3 = u2 * u, h = 1e-4;
    const double h00 = 2 * u3 - 3 * u2 + 1, h01 = 1 - h00, h10 = u3 - 2 * u2 + u, h11 = u3 - u2;
    const double off0 = stance_pitch(duty - h, walking), off = stance_pitch(duty, walking);
    const double on = stance_pitch(0.0, walking), on1 = stance_pitch(h, walking);
    const Vec3d va = (ankle(side, 0, off) - ankle(side, 0, off0)) * (span / h);
    const Vec3d vb = (ankle(side, 0, on1) - ankle(side, 0, on)) * (span / h);
    f.ankle = ankle(side, here, off) * h00 + va * h10 + ankle(side, next, on) * h01 + vb * h11;
    f.ankle.y += 0.80 * u2 * (1 - u) * (1 - u) * walking;
    f.pitch = off * h00 + (off - off0) * (span / h) * h10 + on * h01;
    f.toe = max(-f.pitch, 0.0) * (1 - smooth(u));
  }
  const double turn = std::sin(kTwoPi * (s.turn_cycles + 0.5 * side));
  f.ankle.y += 0.04 * s.turning * max(turn, 0.0);
  return f;
}

WalkMotion::LegPose WalkMotion::solve(int side, const PelvisPose& b, const FootPose& f) const {
  const int first = side == 0 ? kRightHip : kLeftHip;
  const Vec3d hip = b.pelvis + rotate(b.rotation, rest(first) - rest(kPelvis));
  const Vec3d thigh0 = rest(first + 1) - rest(first), shin0 = rest(first + 2) - rest(first + 1);
  const double l1 = norm(thigh0), l2 = norm(shin0);
  const Vec3d to = f.ankle - hip;
  LegPose leg;
  leg.stretch = norm(to) / (l1 + l2);
  const double reach = clamp(norm(to), 1.01 * abs(l1 - l2) + 1e-6, 0.9999 * (l1 + l2));
  const Vec3d down = normalized(to);
  const Vec3d ahead = rotate(b.rotation, Vec3d{0, 0, -1});
  const Vec3d forward = normalized(ahead - down * dot(ahead, down));
  const double cosine = clamp((l1 * l1 + reach * reach - l2 * l2) / (2 * l1 * reach), -1.0, 1.0);
  const Vec3d thigh = down * cosine + forward * sqrt(max(0.0, 1 - cosine * cosine));
  const Vec3d shin = normalized(down * reach - thigh * l1);
  const Vec3d hinge = cross(down, forward);
  leg.thigh = align(thigh0, thigh, hinge);
  leg.shin = align(shin0, shin, hinge);
  return leg;
}

}  // namespace gsnav
