// SPDX-License-Identifier: Apache-2.0
// People's capsules, made with as little posing as may be: the same bits as with all of it.
#include <doctest/doctest.h>

#include <cstring>
#include <span>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
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

TEST_CASE("a ball of joints contains all of them, and its placement is that of the pose") {
  int known = 0;
  double used = 0;
  for (const AvatarActor& actor : actors()) {
    for (int i = 0; i < 400; ++i) {
      const double t = 0.061 * i;
      const auto ball = actor.joint_ball(t);
      if (!ball) continue;
      ++known;
      std::vector<Affine3<double>> globals;
      const Similarity world = actor.joint_globals(t, globals);
      REQUIRE(world.translation == ball->placement.translation);
      REQUIRE(world.scale == ball->placement.scale);
      const Vec3d p{0.3, -0.2, 0.7};
      REQUIRE(norm(world * p - ball->placement * p) < 1e-12);
      for (const Affine3<double>& g : globals) {
        const double away = norm(g.translation - ball->joints.center);
        REQUIRE(away <= ball->joints.radius);
        used = max(used, away / ball->joints.radius);
      }
    }
  }
  CHECK(known == 800);  // of the walkers
  CHECK(used > 0.4);
}

TEST_CASE("a body that is skipped by its ball is not seen by its pose") {
  const AvatarActor actor = peopled_scene(2000).avatars[0];
  SerialBackend backend;
  SkinnedGaussians<SerialBackend> skin(backend, actor.asset());
  const BodyBounds bounds(*actor.asset());
  Rng rng(4);
  int seen = 0, outside = 0;
  for (int i = 0; i < 600; ++i) {
    const double t = rng.uniform(0, 30);
    const Vec3d at = actor.placement(t).translation;
    const Vec3d eye = at + Vec3d{rng.uniform(-4, 4), rng.uniform(0.2, 2), rng.uniform(-4, 4)};
    const Vec3d to = at + Vec3d{rng.uniform(-4, 4), rng.uniform(0, 2), rng.uniform(-4, 4)};
    const Camera camera = Camera::look_at(eye, to, {0, 1, 0}, 40, 30, 80);
    REQUIRE(skin.prepare(actor, t, std::span(&camera, 1), {}).ok());
    std::vector<Affine3<double>> globals;
    GaussianSet set{};
    set.world_from_asset = actor.joint_globals(t, globals);
    set.eps2d = actor.asset()->cloud.eps2d;
    const bool truth = SkinnedGaussians<SerialBackend>::is_seen(camera, {}, set, bounds.at(globals));
    REQUIRE((skin.set().gaussians.size() != 0) == truth);
    (truth ? seen : outside) += 1;
  }
  CHECK(seen > 100);
  CHECK(outside > 100);
}

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
