// SPDX-License-Identifier: Apache-2.0
// People's capsules, made with as little posing as may be: the same bits as with all of it.
#include <doctest/doctest.h>

#include <cstring>

#include "gsnav/detail/demo/people.hpp"
#include "sim_scene.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

bool same(const Capsule<double>& a, const Capsule<double>& b) {
  return a.p0 == b.p0 && a.p1 == b.p1 && a.radius == b.radius;
}

/// Of all joints' places.
std::vector<Capsule<double>> of_whole_pose(const AvatarActor& actor, double t) {
  std::vector<Affine3<double>> globals;
  actor.joint_globals(t, globals);
  const Similarity world = actor.placement(t);
  std::vector<Capsule<double>> out;
  for (const ProxyCapsule& c : actor.asset()->capsules) {
    const Affine3<double>& g = globals[c.joint];
    out.push_back({world * (g * c.p0), world * (g * c.p1), c.radius * world.scale});
  }
  return out;
}

/// A clip of random poses, with a path, of the body's own skeleton.
std::shared_ptr<const MotionClip> random_clip(const AvatarAsset& body) {
  Rng rng(8);
  auto clip = std::make_shared<MotionClip>();
  clip->joints = body.skeleton.size();
  const LocalPose rest = body.skeleton.rest_pose();
  for (int key = 0; key < 5; ++key) {
    for (std::size_t j = 0; j < clip->joints; ++j) {
      const Vec3d axis = normalized(Vec3d{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(0.1, 1)});
      clip->rotations.push_back(rest.rotations[j] * axis_angle(axis, rng.uniform(-0.4, 0.4)));
      clip->translations.push_back(rest.translations[j] * rng.uniform(0.9, 1.1));
    }
    clip->root_translation.push_back({0, 0, -0.1 * key});
  }
  return clip;
}

std::vector<AvatarActor> actors() {
  std::vector<AvatarActor> all = peopled_scene(2000).avatars;
  const auto body = all.front().asset();
  ActorOptions looped;
  looped.loop_period = 2.0;
  looped.loop_blend = 0.5;
  all.push_back(AvatarActor::create(body, random_clip(*body)).value());
  all.push_back(AvatarActor::create(body, random_clip(*body), nullptr, looped).value());
  all.push_back(AvatarActor::create(body).value());
  return all;
}

}  // namespace

TEST_CASE("capsules are those of the whole pose, bit for bit") {
  for (const AvatarActor& actor : actors()) {
    for (int i = 0; i < 60; ++i) {
      const double t = 0.173 * i;
      const auto made = actor.capsules(t), whole = of_whole_pose(actor, t);
      REQUIRE(made.size() == whole.size());
      for (std::size_t c = 0; c < made.size(); ++c) REQUIRE(same(made[c], whole[c]));
    }
  }
}

TEST_CASE("an interval's bodies are the same where an earlier one's end is used for their begin") {
  SimulatorScene scene = flat_scene();
  scene.avatars = actors();
  ActorOptions late;  // comes and goes
  late.time_begin = 1.1;
  late.time_end = 2.3;
  scene.avatars.insert(scene.avatars.begin() + 1,
                       AvatarActor::create(scene.avatars[0].asset(), nullptr, nullptr, late).value());
  CapsuleSet before;
  for (int k = 0; k < 16; ++k) {
    const double t0 = 0.25 * k, t1 = 0.25 * (k + 1);
    std::vector<DynamicCapsule> anew, after;
    append_bodies(scene, t0, t1, anew);
    append_bodies(scene, t0, t1, after, &before);
    REQUIRE(anew.size() == after.size());
    for (std::size_t i = 0; i < anew.size(); ++i) {
      REQUIRE(anew[i].avatar == after[i].avatar);
      REQUIRE(anew[i].bone == after[i].bone);
      REQUIRE(same(anew[i].motion.begin, after[i].motion.begin));
      REQUIRE(same(anew[i].motion.end, after[i].motion.end));
    }
    before = CapsuleSet::create(std::move(after), t0, t1).value();
  }
}
