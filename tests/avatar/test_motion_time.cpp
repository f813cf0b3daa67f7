// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "avatar/support.hpp"
#include "gsnav/detail/math/screw.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

using Pose = RigidPose<double>;

Pose operator*(const Pose& a, const Pose& b) {
  return {a.rotation * b.rotation, a.translation + rotate(a.rotation, b.translation)};
}
Pose inverted(const Pose& a) {
  return {conjugate(a.rotation), -rotate(conjugate(a.rotation), a.translation)};
}
double apart(const Pose& a, const Pose& b) {
  return std::max(norm(a.translation - b.translation), angle_between(a.rotation, b.rotation));
}

}  // namespace

TEST_CASE("a screw turns and advances at a constant rate, whichever point of the body is its origin") {
  Rng rng(11);
  for (const double degrees : {0.0, 1e-6, 1e-3, 1.0, 40.0, 179.0}) {
    for (int i = 0; i < 50; ++i) {
      const Vec3d axis = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
      const Pose a{random_rotation(rng), {rng.normal(), rng.normal(), rng.normal()}};
      const Pose b{a.rotation * axis_angle(axis, degrees * 0.017453292519943295),
                   {rng.normal(), rng.normal(), rng.normal()}};
      CHECK(apart(screw_between(a, b, 0.0), a) < 1e-9);
      CHECK(apart(screw_between(a, b, 1.0), b) < 1e-9);
      // A quarter of the way, made four times, is the whole; from anywhere a step is the same.
      const Pose quarter = inverted(a) * screw_between(a, b, 0.25);
      CHECK(apart(a * quarter * quarter * quarter * quarter, b) < 1e-9);
      CHECK(apart(inverted(screw_between(a, b, 0.25)) * screw_between(a, b, 0.5), quarter) < 1e-9);
      const Pose origin{random_rotation(rng), {rng.normal(), rng.normal(), rng.normal()}};
      CHECK(apart(screw_between(a * origin, b * origin, 0.3), screw_between(a, b, 0.3) * origin) < 1e-9);
    }
  }
  // A quarter turn about a vertical axis two metres away is an arc.
  const Pose a{{}, {2, 0, 0}}, b{axis_angle(Vec3d{0, 1, 0}, std::acos(0.0)), {0, 0, -2}};
  const double h = std::sqrt(2.0);
  CHECK(norm(screw_between(a, b, 0.5).translation - Vec3d{h, 0, -h}) < 1e-12);
}

TEST_CASE("a walker's root goes round a bend as a rigid body, at any frame rate") {
  MotionClip slow, fast;
  const auto fill = [](MotionClip& clip, int frames) {
    clip.joints = 1;
    clip.frame_rate = (frames - 1) / 2.0;
    clip.end = ClipEnd::hold;
    clip.translations = {{0, 1, 0}};
    for (int t = 0; t < frames; ++t) {
      const double a = 3.0 * t / (frames - 1);
      clip.rotations.push_back(axis_angle(Vec3d{0, 1, 0}, a));
      clip.root_translation.push_back({2 * std::cos(a) - 2, 0.1 * a, -2 * std::sin(a)});
    }
  };
  fill(slow, 4);
  fill(fast, 601);
  for (double t = 0; t < 2; t += 0.013) {
    LocalPose a, b;
    slow.pose({t}, a);
    fast.pose({t}, b);
    CHECK(norm(a.root - b.root) < 1e-12);
    CHECK(angle_between(a.rotations[0], b.rotations[0]) < 1e-6);
  }
}

TEST_CASE("a clip starts where it is told and plays as fast as it is told") {
  MotionClip clip;
  clip.joints = 1;
  clip.frame_rate = 10;
  clip.end = ClipEnd::hold;
  clip.translations = {{0, 1, 0}};
  for (int t = 0; t <= 20; ++t) {
    clip.rotations.push_back(axis_angle(Vec3d{0, 0, 1}, 0.1 * t));
    clip.root_translation.push_back({0.3 * t, 0, 0});
  }
  MotionClip changed = clip;
  changed.start = 0.35;
  changed.playback_rate = 1.7;
  REQUIRE(changed.validate().ok());
  for (double t = -1; t < 3; t += 0.11) {
    LocalPose a, b;
    clip.pose({0.35 + 1.7 * t}, a);
    changed.pose({t}, b);
    CHECK(norm(a.root - b.root) < 1e-12);
    CHECK(angle_between(a.rotations[0], b.rotations[0]) < 1e-6);
  }
  const MotionClip part = clip.section(5, 6).value();
  CHECK(part.frames() == 6);
  LocalPose a, b;
  clip.pose({0.77}, a);
  part.pose({0.27}, b);
  CHECK(norm(a.root - b.root) < 1e-12);
  CHECK_FALSE(clip.section(5, 17).ok());
  CHECK_FALSE(clip.section(0, 0).ok());
  changed.playback_rate = 0;
  CHECK(changed.validate().message().find("playback_rate") != std::string::npos);
  changed.playback_rate = 1;
  changed.start = std::nan("");
  CHECK(changed.validate().message().find("start") != std::string::npos);
}
