// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "avatar_files/bodies.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/demo/humanoid.hpp"
#include "gsnav/detail/rigging/capsule_fit.hpp"
#include "gsnav/detail/rigging/capsule_volume.hpp"
#include "gsnav/detail/rigging/mesh_avatar.hpp"
#include "support/sanitized.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Share of centres that lie within some capsule, by hand in long double.
double held(const AvatarAsset& asset, const std::vector<ProxyCapsule>& capsules,
            const std::vector<Affine3<double>>& pose) {
  const auto joints = times_binds(asset.skeleton, pose);
  const std::size_t row = static_cast<std::size_t>(asset.influences);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < asset.size(); ++i) {
    long double x[3] = {0, 0, 0};
    for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
      const Vec3d p = joints[asset.joint_indices[k]] * asset.cloud.mean(i);
      for (int c = 0; c < 3; ++c)
        x[c] += static_cast<long double>(p[c]) * asset.skinning_weights[k] / 65535.0L;
    }
    bool in = false;
    for (const ProxyCapsule& c : capsules) {
      const Vec3d a = pose[c.joint] * c.p0, b = pose[c.joint] * c.p1;
      long double ab2 = 0, along = 0, d2 = 0;
      for (int k = 0; k < 3; ++k) {
        ab2 += static_cast<long double>(b[k] - a[k]) * static_cast<long double>(b[k] - a[k]);
        along += (x[k] - static_cast<long double>(a[k])) * static_cast<long double>(b[k] - a[k]);
      }
      const long double t = ab2 > 0 ? std::clamp(along / ab2, 0.0L, 1.0L) : 0.0L;
      for (int k = 0; k < 3; ++k) {
        const long double d =
            x[k] - static_cast<long double>(a[k]) - t * static_cast<long double>(b[k] - a[k]);
        d2 += d * d;
      }
      in = in || std::sqrt(d2) <= static_cast<long double>(c.radius) + 1e-12L;
    }
    inside += in ? 1 : 0;
  }
  return static_cast<double>(inside) / static_cast<double>(asset.size());
}

void check_body(const char* name, AvatarAsset asset,
                const std::vector<std::vector<Affine3<double>>>& poses) {
  const auto r = fit_body_capsules(asset, poses);
  CAPTURE(r.status().message());
  REQUIRE(r.ok());
  const CapsuleReport thin = measure_capsules(asset, habitat_capsules(asset.skeleton), poses);
  std::printf(
      "%s: %zu capsules by percentile %.4f hold at least %.4f of the centres in %zu poses, %.1f mm "
      "outside at most; "
      "over-cover %.1f mm mean, %.1f mm p99. A tenth of the bones' lengths (%zu capsules): %.4f, %.1f "
      "mm outside\n",
      name, r->capsules, r->percentile, r->contained_least, r->poses, 1e3 * r->outside_greatest,
      1e3 * r->over_mean, 1e3 * r->over_p99, thin.capsules, thin.contained_least,
      1e3 * thin.outside_greatest);
  std::printf(
      "  of %.1f l of body %.2f %% uncovered, %.2f %% in the worst pose; %.0f %% of it over-covered. By "
      "the bones' "
      "lengths %.1f %% uncovered\n",
      1e3 * r->body_volume, 100 * r->uncovered_mean, 100 * r->uncovered_greatest, 100 * r->over_volume,
      100 * thin.uncovered_mean);
  CHECK(r->uncovered_greatest < 0.02);
  CHECK(thin.uncovered_mean > 0.5);
  double least = 1;
  for (const auto& pose : poses) least = std::min(least, held(asset, asset.capsules, pose));
  CHECK(least >= 0.99);
  CHECK(r->contained_least == doctest::Approx(least).epsilon(1e-4));
  CHECK(thin.contained_least < 0.5);
  CHECK(r->capsules <= 70);
  CHECK(r->over_mean < 0.06);
  CHECK(asset.validate().ok());
}

}  // namespace

TEST_CASE("fitted capsules of a body that is capsules are those capsules") {
  AvatarAsset asset;
  asset.skeleton.names = {"low", "high"};
  asset.skeleton.parents = {-1, 0};
  asset.skeleton.rest_local = {
      {Mat3d::identity(), {0, 1, 0}},
      {rotation_matrix(axis_angle(normalized(Vec3d{1, 2, 3}), 0.8)), {0.8, 0, 0}}};
  GaussianCloudBuilder builder(0);
  RawGaussian g;
  g.opacity_logit = 3;
  Rng rng(2);
  std::vector<std::uint16_t> joints;
  const Vec3d ends[2][2] = {{{-0.3, 1, 0}, {0.3, 1.1, 0.1}}, {{1.2, 0.6, 0}, {1.2, 0.6, 0.4}}};
  const double radii[2] = {0.1, 0.15};
  for (std::uint16_t c = 0; c < 2; ++c) {
    for (int i = 0; i < 8000; ++i) {
      const Vec3d d = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
      const Vec3d axis = normalized(ends[c][1] - ends[c][0]);
      g.mean = i % 2 == 0 ? (dot(d, axis) > 0 ? ends[c][1] : ends[c][0]) + d * radii[c]
                          : lerp(ends[c][0], ends[c][1], rng.uniform()) +
                                normalized(d - axis * dot(d, axis)) * radii[c];
      builder.add(g);
      joints.push_back(c);
    }
  }
  asset.cloud = builder.cloud();
  asset.set_weights(1, joints, std::vector<float>(joints.size(), 1.0f)).value();
  const auto pose = asset.skeleton.rest_globals();
  CapsuleFitOptions options;
  options.percentile = 1.0;
  const CapsuleReport r = fit_body_capsules(asset, {pose}, options).value();
  REQUIRE(r.capsules == 2);
  for (std::size_t c = 0; c < 2; ++c) {
    const ProxyCapsule& p = asset.capsules[c];
    Vec3d a = pose[p.joint] * p.p0, b = pose[p.joint] * p.p1;
    if (norm(a - ends[c][0]) > norm(b - ends[c][0])) std::swap(a, b);
    CHECK(norm(a - ends[c][0]) < 0.01);
    CHECK(norm(b - ends[c][1]) < 0.01);
    CHECK(p.radius == doctest::Approx(radii[c]).epsilon(0.03));
  }
  CHECK(r.contained_least == 1.0);
  CHECK(r.over_p99 < 0.02);
  options.percentile = 0.2;
  CHECK(fit_body_capsules(asset, {pose}, options).message().find("percentile") != std::string::npos);
  CHECK(fit_body_capsules(asset, {}, {}).message().find("no poses") != std::string::npos);
  CHECK(fit_body_capsules(asset, {{pose[0]}}, {}).message().find("a pose of 1 joints") !=
        std::string::npos);
}

TEST_CASE("capsules hold people while they walk") {
  constexpr int kPoses = kSanitized ? 4 : 12;  // sanitizers are slow
  const AvatarAsset person = make_humanoid({.gaussians = 20000});
  const WalkMotion walk = WalkMotion::create(person.skeleton).value();
  std::vector<std::vector<Affine3<double>>> poses;
  for (int k = 0; k < kPoses; ++k) {
    LocalPose pose;
    walk.pose(k / static_cast<double>(kPoses), 1.0, 0.0, pose);
    poses.push_back(joints_at(person.skeleton, pose));
  }
  check_body("humanoid", person, poses);
  for (const char* name : {"lumberjack.glb", "cesium_man.gltf"}) {
    const TestBody body = gltf_body(name);
    if (!body.ok) continue;
    MeshAvatarOptions options;
    options.gaussians = 20000;
    check_body(name, make_mesh_avatar(body.loaded.mesh, options).value().asset,
               poses_of(body.loaded.mesh.skeleton, body.loaded.clips[0].clip, kPoses));
  }
}

TEST_CASE("volumes of a ball, and of what capsules leave of it and cover beside it") {
  std::vector<Vec3d> ball;
  for (int k = 0; k < 40000; ++k) {
    const double z = -1 + (2.0 * k + 1) / 40000, q = std::sqrt(1 - z * z), a = 2.399963229728653 * k;
    ball.push_back({0.3 * q * std::cos(a), 1 + 0.3 * z, 0.3 * q * std::sin(a)});
  }
  const double volume = 4.0 / 3 * 3.14159265358979 * 0.027;
  const CapsuleVolume none = measure_capsule_volume(ball, {});
  CHECK(none.body == doctest::Approx(volume).epsilon(0.02));
  CHECK(none.uncovered == none.body);
  CHECK(none.over == 0);
  const CapsuleVolume small = measure_capsule_volume(ball, {{{0, 1, 0}, {0, 1, 0}, 0.2}});
  CHECK(small.uncovered == doctest::Approx(volume * 19.0 / 27).epsilon(0.03));
  CHECK(small.over == 0);
  // Twice as wide, and one that stands apart.
  const CapsuleVolume large =
      measure_capsule_volume(ball, {{{0, 1, 0}, {0, 1, 0}, 0.6}, {{2, 1, 0}, {2, 1.5, 0}, 0.1}});
  CHECK(large.uncovered == 0);
  const double apart = 3.14159265358979 * 0.01 * (0.5 + 4.0 / 3 * 0.1);
  CHECK(large.over == doctest::Approx(7 * volume + apart).epsilon(0.02));
}
