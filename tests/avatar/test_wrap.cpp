// SPDX-License-Identifier: Apache-2.0
// Nobody jumps where a clip or the scene's clock begins again.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "avatar/support.hpp"
#include "support/joints.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A recording of 2 s that goes 3 m ahead, turns, and ends in another pose than it begins in.
MotionClip wandering() {
  const Skeleton& skeleton = person()->skeleton;
  const WalkMotion walk = WalkMotion::create(skeleton).value();
  MotionClip clip;
  clip.frame_rate = 30;
  clip.joints = skeleton.size();
  for (int t = 0; t <= 60; ++t) {
    LocalPose pose;
    walk.pose(t / 25.0, 1, 0, pose);
    pose.rotations[0] = axis_angle(Vec3d{0, 1, 0}, t / 40.0) * pose.rotations[0];
    clip.rotations.insert(clip.rotations.end(), pose.rotations.begin(), pose.rotations.end());
    clip.translations.insert(clip.translations.end(), pose.translations.begin(),
                             pose.translations.end());
    clip.root_translation.push_back({0.02 * t, 0, -0.05 * t});
  }
  return clip;
}

/// The furthest that any joint gets within `step` seconds, over [begin, end].
double furthest(const AvatarActor& actor, double begin, double end, double step) {
  double worst = 0;
  std::vector<Vec3d> before = joints_in_world(actor, begin);
  for (double t = begin + step; t < end; t += step) {
    const std::vector<Vec3d> now = joints_in_world(actor, t);
    for (std::size_t j = 0; j < now.size(); ++j) worst = std::max(worst, norm(now[j] - before[j]));
    before = now;
  }
  return worst;
}

}  // namespace

TEST_CASE("a clip that loops brings every joint back without a jump, as fast as is allowed") {
  constexpr double kStep = 1e-3;
  for (const ClipEnd end : {ClipEnd::loop, ClipEnd::loop_forward}) {
    MotionClip clip = wandering();
    clip.end = end;
    const auto speed_over_wrap = [&](const MotionClip& c) {
      const AvatarActor actor =
          AvatarActor::create(person(), std::make_shared<const MotionClip>(c)).value();
      return furthest(actor, c.duration() - 0.01, c.period() + 0.01, kStep) / kStep;
    };
    const double abrupt = speed_over_wrap(clip);
    CHECK(abrupt > 5);  // what there is to mend
    clip.wrap_time = smooth_wrap_time(person()->skeleton, clip, end == ClipEnd::loop_forward, 1.5);
    // At the ends the clip's own motion is in it; a key is 33 ms, the recording's hands are faster.
    const AvatarActor actor =
        AvatarActor::create(person(), std::make_shared<const MotionClip>(clip)).value();
    CHECK(furthest(actor, clip.duration() + kStep, clip.period() - kStep, kStep) <= 1.5 * kStep * 1.02);
    const double inside = furthest(actor, 0, clip.duration(), kStep);
    CHECK(furthest(actor, clip.duration() - 0.1, clip.period() + 0.1, kStep) <=
          std::max(inside, 1.5 * kStep * 1.02));
    // A thousandth of a second before the wrap's end it is nearly there.
    const auto a = joints_in_world(actor, clip.period() - 1e-9),
               b = joints_in_world(actor, clip.period() + 1e-9);
    for (std::size_t j = 0; j < a.size(); ++j) CHECK(norm(a[j] - b[j]) < 1e-7);
  }
  MotionClip closed = wandering();
  for (std::size_t j = 0; j < closed.joints; ++j) {
    closed.rotations[60 * closed.joints + j] = closed.rotations[j];
    closed.translations[60 * closed.joints + j] = closed.translations[j];
  }
  closed.root_translation[60] = closed.root_translation[0];
  CHECK(smooth_wrap_time(person()->skeleton, closed) < 1e-9);
}

TEST_CASE("where the scene's clock begins again everybody gets back by and by") {
  MotionClip clip = wandering();
  clip.end = ClipEnd::hold;
  const auto motion = std::make_shared<const MotionClip>(clip);
  const AvatarActor once = AvatarActor::create(person(), motion).value();
  const AvatarActor actor = once.looped(2.0 + 3.0, 3.0).value();
  constexpr double kStep = 1e-3;
  // Without blending the step over the clock's end is the whole way.
  const AvatarActor jumps = once.looped(2.0, 0.0).value();
  CHECK(furthest(jumps, 1.9, 2.1, kStep) > 3.0);
  // No faster than the recording itself, and getting back is 3.2 m in 3 s and the limbs.
  CHECK(furthest(actor, 0.0, 11.0, kStep) <= furthest(once, 0.0, 2.0, kStep) * 1.001);
  CHECK(furthest(actor, 2.0 + kStep, 5.0 - kStep, kStep) < 2.5 * kStep);
  for (const double t : {0.0, 0.7, 1.99}) {
    const auto a = joints_in_world(actor, t), b = joints_in_world(once, t),
               c = joints_in_world(actor, t + 15.0);
    for (std::size_t j = 0; j < a.size(); ++j) {
      CHECK(norm(a[j] - b[j]) < 1e-12);
      CHECK(norm(a[j] - c[j]) < 1e-9);
    }
  }
  // Capsules of a step that ends after the wrap.
  std::vector<DynamicCapsule> moved;
  actor.dynamic_capsules(4.9, 5.1, 0, moved);
  REQUIRE(moved.size() == person()->capsules.size());
  for (const DynamicCapsule& m : moved) CHECK(norm(m.motion.begin.p0 - m.motion.end.p0) < 0.2 * 5);
}

TEST_CASE("who is not there at both ends of a looping clock is gone while others get back") {
  ActorOptions options;
  options.time_begin = 1;
  options.time_end = 4;
  options.loop_period = 5;
  options.loop_blend = 1;
  const AvatarActor late = AvatarActor::create(person(), nullptr, nullptr, options).value();
  for (const double t : {1.0, 3.9, 4.0, 6.0, 13.9}) CHECK(late.active(t));
  for (const double t : {0.5, 4.5, 4.999, 5.5, 9.5}) CHECK_FALSE(late.active(t));
  std::vector<DynamicCapsule> none;
  late.dynamic_capsules(4.3, 4.8, 0, none);
  CHECK(none.empty());
  late.dynamic_capsules(5.9, 6.1, 0, none);
  CHECK_FALSE(none.empty());
  options.loop_blend = 6;
  CHECK(AvatarActor::create(person(), nullptr, nullptr, options).message().find("loop_blend") !=
        std::string::npos);
}

TEST_CASE("who leaves or comes while a looping clock's step is taken sweeps through nothing") {
  /// Walks 6 m in five seconds.
  struct Line : Trajectory {
    TrajectorySample at(double t) const override {
      TrajectorySample s;
      s.distance = 1.2 * clamp(t, 0.0, 5.0);
      s.position = {s.distance, 0, 0};
      return s;
    }
  };
  for (const double blend : {0.0, 0.5}) {
    for (const double begin : {0.0, 5.0}) {
      ActorOptions options;
      options.time_begin = begin;
      options.time_end = begin + 5;
      options.loop_period = 10 + blend;
      options.loop_blend = blend;
      const AvatarActor actor =
          AvatarActor::create(person(), nullptr, std::make_shared<Line>(), options).value();
      for (const double edge : {begin, begin + 5, begin + options.loop_period}) {
        for (const double before : {0.05, 0.1, 0.2}) {
          std::vector<DynamicCapsule> moved;
          actor.dynamic_capsules(edge - before, edge - before + 0.25, 0, moved);
          CAPTURE(edge - before);
          for (const DynamicCapsule& m : moved)
            CHECK(norm(m.motion.begin.p0 - m.motion.end.p0) < 0.25 * 3.5);
        }
      }
    }
  }
}

TEST_CASE(
    "who is there for less than a step of a looping clock is in that step, as it is while it is there") {
  /// Walks at 1.2 m/s, whatever the time.
  struct Line : Trajectory {
    TrajectorySample at(double t) const override {
      TrajectorySample s;
      s.position = {1.2 * t, 0, 0};
      return s;
    }
  };
  constexpr double kStep = 0.25;
  const auto apart = [](const Capsule<double>& a, const Capsule<double>& b) {
    return std::max(norm(a.p0 - b.p0), norm(a.p1 - b.p1));
  };
  for (const double blend : {0.0, 0.3}) {
    for (const double begin :
         {-0.04, 0.0, 0.6, 0.93, 1.4}) {  // the fourth is cut off by the clock's end, or by its blend
      for (const double length : {0.02, 0.1}) {
        ActorOptions options;
        options.time_begin = begin;
        options.time_end = begin + length;
        options.loop_period = 1.0 + blend;
        options.loop_blend = blend;
        const AvatarActor actor =
            AvatarActor::create(person(), nullptr, std::make_shared<Line>(), options).value();
        const double come = std::max(begin, 0.0), leave = std::min(begin + length, 1.0 - 1e-9);
        CAPTURE(blend);
        CAPTURE(begin);
        CAPTURE(length);
        for (int k = 0; k < 120; ++k) {
          const double t0 = 0.0371 * k, t1 = t0 + kStep;
          // In which rounds it is there within the step, by trying them all.
          std::vector<double> rounds;
          for (int n = 0; n < 8 && come <= leave; ++n) {
            const double at = n * options.loop_period;
            if (at + come <= t1 && at + leave >= t0) rounds.push_back(at);
          }
          std::vector<DynamicCapsule> moved;
          actor.dynamic_capsules(t0, t1, 0, moved);
          CAPTURE(t0);
          REQUIRE(moved.size() == (rounds.empty() ? 0 : person()->capsules.size()));
          if (rounds.size() != 1) continue;
          const auto first = actor.capsules(std::max(t0, rounds[0] + come + 1e-9)),
                     last = actor.capsules(std::min(t1, rounds[0] + leave - 1e-9));
          REQUIRE(first.size() == moved.size());
          REQUIRE(last.size() == moved.size());
          for (std::size_t c = 0; c < moved.size(); ++c) {
            CHECK(apart(moved[c].motion.begin, first[c]) < 1e-7);
            CHECK(apart(moved[c].motion.end, last[c]) < 1e-7);
          }
        }
      }
    }
  }
}

TEST_CASE("who is always there is there wherever a looping clock's remainder rounds to") {
  for (int m = 10; m < 100; ++m) {
    ActorOptions options;
    options.time_end = options.loop_period = m / 30.0;
    const AvatarActor actor = AvatarActor::create(person(), nullptr, nullptr, options).value();
    int gone = 0;
    for (int n = 0; n < 3000; ++n) gone += actor.active(n / 30.0) ? 0 : 1;
    CAPTURE(m);
    CHECK(gone == 0);
  }
}
