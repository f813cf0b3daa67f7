// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "avatar/support.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Skeleton chain(std::size_t n, double length) {
  Skeleton s;
  for (std::size_t j = 0; j < n; ++j) {
    s.names.push_back("joint" + std::to_string(j));
    s.parents.push_back(static_cast<std::int32_t>(j) - 1);
    s.rest_local.emplace_back();
    s.rest_local.back().translation = {0, j == 0 ? 1.0 : length, 0};
  }
  return s;
}

bool says(const Status& s, const char* word) { return s.message().find(word) != std::string::npos; }

Vec3d end_of(const Skeleton& s, const MotionSource& m, double t) {
  LocalPose pose;
  std::vector<Affine3<double>> g;
  MotionInput at;
  at.time = t;
  m.pose(at, pose);
  forward_kinematics(s, pose, g);
  return g.back() * Vec3d{0, 0.25, 0} + pose.root;
}

}  // namespace

TEST_CASE("a skeleton that cannot be is refused by the joint's name") {
  CHECK(chain(4, 0.2).validate().ok());
  Skeleton s = chain(4, 0.2);
  s.names[2] = "joint1";
  CHECK(says(s.validate(), "joint 2 (\"joint1\")"));
  s = chain(4, 0.2);
  s.names[1].clear();
  CHECK(says(s.validate(), "joint 1 has no name"));
  s = chain(4, 0.2);
  s.parents[1] = 3;
  CHECK(says(s.validate(), "joint 1 (\"joint1\") is its own ancestor"));
  s = chain(4, 0.2);
  s.parents[2] = 2;
  CHECK(says(s.validate(), "own ancestor"));
  s = chain(4, 0.2);
  s.parents = {-1, 2, 0, 1};
  CHECK(says(s.validate(), "comes before its parent 2"));
  s.parents = {-1, 0, 9, 2};
  CHECK(says(s.validate(), "has parent 9 of 4"));
  s.parents = {-1, 3, 1, 100};  // out of range behind a forward reference
  CHECK_FALSE(s.validate().ok());
  s = chain(4, 0.2);
  s.rest_local.pop_back();
  CHECK(says(s.validate(), "rest_local has 3"));
  s = chain(4, 0.2);
  s.rest_local[3].linear = s.rest_local[3].linear * 2.0;
  CHECK(says(s.validate(), "joint 3"));
  s = chain(4, 0.2);
  s.inverse_binds.resize(4);
  s.inverse_binds[1].translation.x = std::nan("");
  CHECK(says(s.validate(), "joint 1"));
  CHECK_FALSE(Skeleton{}.validate().ok());
}

TEST_CASE("between keys joints turn and bones keep their length") {
  const Skeleton s = chain(3, 0.25);
  for (const double degrees : {10.0, 30.0, 60.0, 179.0}) {
    MotionClip clip;
    clip.frame_rate = 2;
    clip.joints = 3;
    clip.end = ClipEnd::hold;
    const Quatd turn = axis_angle(Vec3d{0, 0, 1}, degrees * 0.017453292519943295);
    clip.rotations = {Quatd{}, Quatd{}, Quatd{}, Quatd{}, turn, -turn};
    clip.translations = s.rest_pose().translations;
    REQUIRE(clip.validate().ok());
    for (const double u : {0.25, 0.5, 0.9}) {
      const double a = u * degrees * 0.017453292519943295;
      const Vec3d want = Vec3d{0, 1.25, 0} + Vec3d{-std::sin(a), std::cos(a), 0} * 0.25 +
                         Vec3d{-std::sin(2 * a), std::cos(2 * a), 0} * 0.25;
      CHECK(norm(end_of(s, clip, 0.5 * u) - want) < 1e-12);
    }
    CHECK(norm(end_of(s, clip, 7.0) - end_of(s, clip, 0.5)) < 1e-12);
    CHECK(norm(end_of(s, clip, -7.0) - end_of(s, clip, 0.0)) < 1e-12);
  }
}

TEST_CASE("clips loop without a jump") {
  const Skeleton s = chain(3, 0.25);
  Rng rng(3);
  MotionClip clip;
  clip.frame_rate = 10;
  clip.joints = 3;
  for (int t = 0; t < 8; ++t) {
    for (int j = 0; j < 3; ++j) clip.rotations.push_back(rotation_within(rng, 25));
    clip.root_translation.push_back({0.1 * t, 0, 0});
  }
  clip.translations = s.rest_pose().translations;
  for (const ClipEnd end : {ClipEnd::loop, ClipEnd::loop_forward}) {
    for (const double wrap : {0.0, 0.4}) {
      clip.end = end;
      clip.wrap_time = wrap;
      double jump = 0;
      for (double t = -2; t < 4; t += 1e-3)
        jump = std::max(jump, norm(end_of(s, clip, t + 1e-3) - end_of(s, clip, t)));
      CHECK(jump < 0.02);  // 1 ms; a teleport would be 0.7 m
      LocalPose a, b;
      MotionInput at;
      at.time = 0.33;
      clip.pose(at, a);
      at.time += clip.period();
      clip.pose(at, b);
      CHECK(angle_between(a.rotations[1], b.rotations[1]) < 1e-6);
      CHECK((b.root - a.root).x == doctest::Approx(end == ClipEnd::loop ? 0.0 : 0.7));
    }
  }
  clip.root_translation.pop_back();
  CHECK(says(clip.validate(), "root_translation"));
  clip.root_translation.clear();
  clip.rotations[4].w += 0.1;
  CHECK(says(clip.validate(), "key 1, joint 1"));
  clip.rotations.pop_back();
  CHECK(says(clip.validate(), "rotations"));
}

TEST_CASE("joint matrices become a clip that gives them back") {
  const Skeleton s = chain(4, 0.2);
  const auto inverse = s.bind_inverses();
  Rng rng(8);
  for (const bool skinning : {false, true}) {
    std::vector<Affine3<double>> matrices;
    std::vector<std::vector<Affine3<double>>> globals(3);
    for (int t = 0; t < 3; ++t) {
      LocalPose pose = s.rest_pose();
      for (auto& q : pose.rotations) q = random_rotation(rng);
      pose.translations[0] += Vec3d{100.0 * t, 0, 5};
      forward_kinematics(s, pose, globals[static_cast<std::size_t>(t)]);
      for (std::size_t j = 0; j < 4; ++j) {
        const auto& g = globals[static_cast<std::size_t>(t)][j];
        matrices.push_back(skinning ? g * inverse[j] : g);
      }
    }
    const MotionClip clip = clip_from_matrices(s, 1.0, matrices, skinning).value();
    CHECK(clip.root_translation[2].x == doctest::Approx(200));
    for (int t = 0; t < 3; ++t) {
      LocalPose pose;
      std::vector<Affine3<double>> g;
      MotionInput at;
      at.time = t;
      clip.pose(at, pose);
      CHECK(norm(pose.translations[0] - s.rest_local[0].translation) < 1e-9);
      forward_kinematics(s, pose, g);
      for (std::size_t j = 0; j < 4; ++j) {
        CHECK(norm(g[j].translation + pose.root - globals[static_cast<std::size_t>(t)][j].translation) <
              1e-9);
      }
    }
    const Mat3d turned = matrices[5].linear, mirror{{{1, 0, 0}, {0, -1, 0}, {0, 0, 1}}};
    for (const Mat3d& linear : {Mat3d{}, turned * mirror}) {
      matrices[5].linear = linear;
      CHECK(says(clip_from_matrices(s, 1.0, matrices, skinning).status(), "key 1, joint 1"));
    }
    matrices.pop_back();
    CHECK_FALSE(clip_from_matrices(s, 1.0, matrices, skinning).ok());
  }
}

TEST_CASE("actors check what they are made of") {
  CHECK_FALSE(AvatarActor::create(nullptr).ok());
  auto wrong = std::make_shared<const FixedPose>(chain(3, 1).rest_pose());
  CHECK(says(AvatarActor::create(person(), wrong).status(), "3 joints"));
  ActorOptions o;
  o.scale = 0;
  CHECK_FALSE(AvatarActor::create(person(), nullptr, nullptr, o).ok());
  o = {};
  o.time_begin = 5;
  o.time_end = 4;
  CHECK_FALSE(AvatarActor::create(person(), nullptr, nullptr, o).ok());
  o.time_end = 8;
  const AvatarActor actor = AvatarActor::create(person(), nullptr, nullptr, o).value();
  CHECK_FALSE(actor.active(4.9));
  CHECK(actor.active(8));
  CHECK(actor.capsules(9).empty());
  CHECK(actor.capsules(6).size() == person()->capsules.size());
  std::vector<DynamicCapsule> out;
  actor.dynamic_capsules(4, 4.5, 3, out);
  CHECK(out.empty());
  actor.dynamic_capsules(4, 5.5, 3, out);
  REQUIRE(out.size() == person()->capsules.size());
  CHECK(out.back().avatar == 3);
  CHECK(out.back().bone == out.size() - 1);
  SerialBackend backend;
  SkinnedGaussians<SerialBackend> skin(backend, person());
  CHECK(skin.set().gaussians.size() == 0);
  CHECK(skin.pose(actor, 6).ok());
  CHECK(skin.set().gaussians.size() == person()->size());
  CHECK(skin.pose(actor, 9).ok());
  CHECK(skin.set().gaussians.size() == 0);
  const AvatarActor other = AvatarActor::create(std::make_shared<const AvatarAsset>(*person())).value();
  CHECK_FALSE(skin.pose(other, 0).ok());
}

TEST_CASE("an actor of another scale is larger in every way") {
  ActorOptions o;
  o.scale = 2;
  const AvatarActor one = AvatarActor::create(person()).value();
  const AvatarActor two = AvatarActor::create(person(), nullptr, nullptr, o).value();
  const auto a = one.capsules(0), b = two.capsules(0);
  for (std::size_t c = 0; c < a.size(); ++c) {
    CHECK(norm(b[c].p0 - a[c].p0 * 2.0) < 1e-12);
    CHECK(b[c].radius == doctest::Approx(2 * a[c].radius));
  }
}

TEST_CASE("a pose that cannot be is refused before anybody stands in it") {
  const auto refused = [](const LocalPose& p, const char* word) {
    const auto made = AvatarActor::create(person(), std::make_shared<const FixedPose>(p));
    CAPTURE(made.status().message());
    CHECK(made.status().code() == Errc::invalid_argument);
    CHECK(says(made.status(), word));
    AvatarAsset asset = *person();
    asset.idle = p;
    CHECK_FALSE(asset.validate().ok());
  };
  LocalPose p = person()->skeleton.rest_pose();
  CHECK(AvatarActor::create(person(), std::make_shared<const FixedPose>(p)).ok());
  p.translations.clear();
  refused(p, "0 translations");
  for (const Quatd& q : {Quatd{0, 0, 0, 0}, Quatd{NAN, 0, 0, 0}, Quatd{3, 0, 0, 0}}) {
    p = person()->skeleton.rest_pose();
    p.rotations[3] = q;
    refused(p, "joint 3");
  }
  p = person()->skeleton.rest_pose();
  p.translations[2].y = NAN;
  refused(p, "joint 2");
  GaitOptions gait;
  gait.arm_swing = NAN;
  CHECK(says(WalkMotion::create(person()->skeleton, gait).status(), "arm_swing"));
  gait = {};
  gait.start_phase = INFINITY;
  CHECK(says(WalkMotion::create(person()->skeleton, gait).status(), "start_phase"));
}
