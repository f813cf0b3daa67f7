// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "avatar/support.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::vector<Affine3<double>> globals_at(const WalkMotion& walk, double cycles, double walking) {
  LocalPose pose;
  walk.pose(cycles, walking, 0, pose);
  std::vector<Affine3<double>> globals;
  forward_kinematics(person()->skeleton, pose, globals);
  return globals;
}

}  // namespace

TEST_CASE("the procedural person is complete") {
  const AvatarAsset& a = *person();
  CHECK(a.validate().ok());
  CHECK(a.skeleton.size() == 55);
  CHECK(a.skeleton.names[0] == "pelvis");
  CHECK(a.skeleton.names[15] == "head");
  CHECK(a.skeleton.names[54] == "right_thumb3");
  CHECK(a.skeleton.parents[static_cast<std::size_t>(a.skeleton.find("left_index1"))] ==
        a.skeleton.find("left_wrist"));
  CHECK(a.size() > 20000);
  CHECK(a.size() < 40000);
  double low = 9, high = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    low = std::min(low, a.cloud.mean(i).y);
    high = std::max(high, a.cloud.mean(i).y);
  }
  CHECK(std::abs(low) < 2e-3);
  CHECK(high == doctest::Approx(1.70).epsilon(0.015));
  // Left is -X, the face is at -Z.
  const auto rest = a.skeleton.rest_globals();
  CHECK(rest[static_cast<std::size_t>(a.skeleton.find("left_hip"))].translation.x < 0);
  CHECK(rest[static_cast<std::size_t>(a.skeleton.find("left_eye_smplhf"))].translation.z < -0.05);
}

TEST_CASE("the same options make the same person, others another") {
  HumanoidOptions o;
  o.gaussians = 3000;
  const AvatarAsset a = make_humanoid(o), b = make_humanoid(o);
  CHECK(a.cloud.means[0] == b.cloud.means[0]);
  CHECK(a.skinning_weights == b.skinning_weights);
  o.seed = 2;
  CHECK(make_humanoid(o).cloud.means[0] != a.cloud.means[0]);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    HumanoidOptions p = random_person(seed);
    p.gaussians = 3000;
    CHECK(try_make_humanoid(p).ok());
  }
  o.height = 5;
  CHECK(try_make_humanoid(o).message().find("height") != std::string::npos);
}

TEST_CASE("there are no holes: every surface point has neighbours in all directions, walking or not") {
  const AvatarAsset& a = *person();
  const WalkMotion walk = WalkMotion::create(a.skeleton).value();
  for (const double phase : {0.0, 0.3, 0.7}) {
    std::vector<Affine3<double>> globals;
    const auto posed = skinned_centers(a, globals_at(walk, phase, 1.0));
    // Gaussians that were within reach of each other stay so, but for the inside of bent joints, where
    // they come nearer.
    double stretched = 0;
    std::size_t pairs = 0, torn = 0;
    for (std::size_t i = 0; i + 1 < a.size(); i += 7) {
      for (std::size_t k = i + 1; k < a.size(); ++k) {
        const Vec3d d = a.cloud.mean(i) - a.cloud.mean(k);
        const double before = dot(d, d);
        const double reach = static_cast<double>(a.cloud.scales[0][i]) * 1.5;
        if (before > reach * reach) continue;
        ++pairs;
        const double ratio = norm(posed[i] - posed[k]) / std::sqrt(before);
        stretched = std::max(stretched, ratio);
        torn += ratio > 2.5 ? 1 : 0;
      }
    }
    CAPTURE(stretched);
    REQUIRE(pairs > 3000);
    CHECK(static_cast<double>(torn) / static_cast<double>(pairs) < 0.01);
  }
}

TEST_CASE("standing feet do not slide, and nothing goes through the floor") {
  const AvatarAsset& a = *person();
  for (const double speed : {0.7, 1.2, 1.6}) {
    GaitOptions o;
    o.speed = speed;
    const WalkMotion walk = WalkMotion::create(a.skeleton, o).value();
    const std::size_t ball[2] = {static_cast<std::size_t>(a.skeleton.find("right_foot")),
                                 static_cast<std::size_t>(a.skeleton.find("left_foot"))};
    const std::size_t ankle[2] = {static_cast<std::size_t>(a.skeleton.find("right_ankle")),
                                  static_cast<std::size_t>(a.skeleton.find("left_ankle"))};
    const auto rest = a.skeleton.rest_globals();
    double slide = 0, lift = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      // The edge of the heel until the foot is flat, then the joint of the toes.
      const Vec3d toes = rest[ball[side]].translation - rest[ankle[side]].translation;
      const Vec3d heel{0, -rest[ankle[side]].translation.y, -0.40 * toes.z};
      const double height[2] = {0, rest[ball[side]].translation.y};
      for (int part = 0; part < 2; ++part) {
        const double from = part == 0 ? 0.0 : 0.11, to = part == 0 ? 0.09 : o.duty - 0.01;
        double low = 1e9, high = -1e9;
        for (int k = 0; k <= 100; ++k) {
          const double p = from + (to - from) * k / 100, cycles = p + (side == 0 ? 0.0 : 0.5) + 3;
          const auto g = globals_at(walk, cycles, 1.0);
          const Vec3d at = g[ankle[side]] * (part == 0 ? heel : toes);
          const double z = at.z - cycles * walk.stride();  // the root goes along -Z
          low = std::min(low, z);
          high = std::max(high, z);
          lift = std::max(lift, std::abs(at.y - height[part]));
        }
        slide = std::max(slide, high - low);
      }
    }
    MESSAGE(speed << " m/s: stride " << walk.stride() << " m, slide " << 1e3 * slide << " mm, lift "
                  << 1e3 * lift << " mm");
    CHECK(slide < 0.005);
    CHECK(lift < 0.005);
    double lowest = 1;
    for (int k = 0; k < 40; ++k) {
      for (const Vec3d& p : skinned_centers(a, globals_at(walk, k / 40.0, 1.0)))
        lowest = std::min(lowest, p.y);
    }
    MESSAGE("lowest Gaussian " << 1e3 * lowest << " mm");
    CHECK(lowest > -0.006);
  }
}

TEST_CASE("the soles of somebody who walks past stay where they touch the floor") {
  // Skinned soles in the world while the foot should stand: what slides is the motion of the stillest of
  // the points within 6 mm of the floor.
  const AvatarAsset& a = *person();
  const AvatarActor actor = make_walker(person(), {{0, 0, 0}, {0, 0, -8}}).value();
  std::vector<std::size_t> soles[2];
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3d p = a.cloud.mean(i);
    if (p.y < 0.006) soles[p.x < 0 ? 0 : 1].push_back(i);
  }
  const auto at = [&](double t, const std::vector<std::size_t>& which) {
    std::vector<Affine3<double>> joints;
    actor.joint_matrices(t, joints);
    const Similarity world = actor.placement(t);
    std::vector<Vec3d> out;
    for (const std::size_t i : which) {
      Vec3d p{};
      for (std::size_t k = 4 * i; k < 4 * i + 4; ++k) {
        p += (joints[a.joint_indices[k]] * a.cloud.mean(i)) * weight_of_parts(a.skinning_weights[k]);
      }
      out.push_back(world * p);
    }
    return out;
  };
  double worst = 0, start = 0;
  const GaitOptions gait;
  const double stride =
      8.0 / 0.5 / std::ceil(8.0 / (0.5 * WalkMotion::create(a.skeleton, gait)->stride()));
  for (std::size_t side = 0; side < 2; ++side) {
    const std::vector<std::size_t>& sole = soles[side];
    REQUIRE(sole.size() > 100);
    double slid = 0;
    const auto standing = [&](double t) {
      const double p =
          actor.trajectory().at(t).distance / stride + 0.43 * gait.duty + (side == 0 ? 0.0 : 0.5);
      return p - std::floor(p) <= gait.duty;
    };
    const double h = 0.01;
    auto before = at(0.0, sole);
    for (double t = 0; t < 7.3; t += h) {
      const auto now = at(t + h, sole);
      double least = 1e9;
      for (std::size_t i = 0; i < now.size(); ++i) {
        if (now[i].y > 0.006 || before[i].y > 0.006) continue;
        least = std::min(least, std::hypot(now[i].x - before[i].x, now[i].z - before[i].z));
      }
      slid = standing(t) && standing(t + h) ? slid + least : 0;
      (t < 1.2 ? start : worst) = std::max(t < 1.2 ? start : worst, slid);
      before = now;
    }
  }
  MESSAGE("a stance slides " << 1e3 * worst << " mm walking, " << 1e3 * start
                             << " mm while starting to walk");
  CHECK(worst < 0.015);
  CHECK(start < 0.015);
}

TEST_CASE("arms swing against the legs") {
  const WalkMotion walk = WalkMotion::create(person()->skeleton).value();
  const auto at = [](const char* name) {
    return static_cast<std::size_t>(person()->skeleton.find(name));
  };
  auto g = globals_at(walk, 0.0, 1.0);  // right heel strikes
  CHECK(g[at("right_ankle")].translation.z < g[at("left_ankle")].translation.z - 0.4);
  CHECK(g[at("right_wrist")].translation.z > g[at("left_wrist")].translation.z + 0.25);
  g = globals_at(walk, 0.5, 1.0);
  CHECK(g[at("right_ankle")].translation.z > g[at("left_ankle")].translation.z + 0.4);
  CHECK(g[at("right_wrist")].translation.z < g[at("left_wrist")].translation.z - 0.25);
  // Knees never bend the wrong way.
  for (int k = 0; k < 60; ++k) {
    g = globals_at(walk, k / 60.0, 1.0);
    for (const std::string s : {"left_", "right_"}) {
      const Vec3d hip = g[at((s + "hip").c_str())].translation,
                  knee = g[at((s + "knee").c_str())].translation,
                  foot = g[at((s + "ankle").c_str())].translation;
      CHECK(cross(knee - hip, foot - knee).x < 0.0);
    }
  }
}

TEST_CASE("a walk needs SMPL's names") {
  Skeleton s = person()->skeleton;
  s.names[9] = "chest";
  CHECK(WalkMotion::create(s).message().find("spine3") != std::string::npos);
}

namespace {

/// Share of points within at least one capsule grown by `slack` metres.
double capsule_coverage(const std::vector<Capsule<double>>& capsules, const std::vector<Vec3d>& points,
                        double slack = 0.0) {
  std::size_t inside = 0;
  for (const Vec3d& p : points) {
    for (const Capsule<double>& c : capsules) {
      const double r = c.radius + slack;
      if (segment_distance2(c.p0, c.p1, p) <= r * r) {
        ++inside;
        break;
      }
    }
  }
  return points.empty() ? 1.0 : static_cast<double>(inside) / static_cast<double>(points.size());
}

/// One capsule per bone, from each joint to each of its children; leaf joints get a point. Radii are
/// zero.
std::vector<ProxyCapsule> bone_capsules(const Skeleton& skeleton) {
  std::vector<ProxyCapsule> out;
  std::vector<bool> has_child(skeleton.size(), false);
  for (std::size_t j = 0; j < skeleton.size(); ++j) {
    const std::int32_t p = skeleton.parents[j];
    if (p < 0) continue;
    has_child[static_cast<std::size_t>(p)] = true;
    const Vec3d tip = skeleton.rest_local[j].translation;
    if (norm(tip) >= 0.02) out.push_back({static_cast<std::uint16_t>(p), {}, tip, 0.0});
  }
  for (std::size_t j = 0; j < skeleton.size(); ++j) {
    if (!has_child[j]) out.push_back({static_cast<std::uint16_t>(j), {}, {}, 0.0});
  }
  return out;
}

}  // namespace

TEST_CASE("capsules hold the body in every frame") {
  const AvatarAsset& a = *person();
  const WalkMotion walk = WalkMotion::create(a.skeleton).value();
  double least = 1, deepest = 0;
  for (int k = 0; k <= 24; ++k) {
    // 24 is standing; phases lie between those that were fitted to.
    const auto g = globals_at(walk, (k + 0.37) / 24, k == 24 ? 0.0 : 1.0);
    std::vector<Capsule<double>> capsules;
    for (const ProxyCapsule& c : a.capsules)
      capsules.push_back({g[c.joint] * c.p0, g[c.joint] * c.p1, c.radius});
    const auto centers = skinned_centers(a, g);
    least = std::min(least, capsule_coverage(capsules, centers));
    deepest = std::max(deepest, 1 - capsule_coverage(capsules, centers, 0.01));
    if (k == 0) CHECK(capsule_coverage(capsules, centers, -0.06) < 0.7);  // they are not just huge
  }
  MESSAGE((100 * least) << " % inside, " << (100 * deepest) << " % more than 1 cm outside");
  CHECK(least >= 0.99);
  // The whole body and not its middle alone: head, hands, feet.
  std::set<std::string> named;
  for (const ProxyCapsule& c : a.capsules) named.insert(a.skeleton.names[c.joint]);
  for (const char* n :
       {"head", "pelvis", "spine3", "left_wrist", "right_wrist", "left_ankle", "right_ankle"}) {
    CHECK(named.count(n) == 1);
  }
  double volume = 0;
  for (const ProxyCapsule& c : a.capsules) {
    volume += 3.1416 * c.radius * c.radius * (norm(c.p1 - c.p0) + 4.0 / 3 * c.radius);
    CHECK(c.radius < 0.16);
  }
  MESSAGE(a.capsules.size() << " capsules, " << 1e3 * volume << " litres with overlaps");
}

TEST_CASE("capsules can be fitted to any body's bones") {
  AvatarAsset a = *person();
  a.capsules = bone_capsules(a.skeleton);
  const auto rest = a.skeleton.rest_globals();
  fit_capsules(a, {rest});
  CHECK(a.validate().ok());
  std::vector<Capsule<double>> world;
  std::vector<Vec3d> centers;
  for (const ProxyCapsule& c : a.capsules)
    world.push_back({rest[c.joint] * c.p0, rest[c.joint] * c.p1, c.radius});
  for (std::size_t i = 0; i < a.size(); ++i) centers.push_back(a.cloud.mean(i));
  CHECK(capsule_coverage(world, centers) >= 0.99);
}
