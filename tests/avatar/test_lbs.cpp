// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "avatar/support.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("the actor in its bind pose is the canonical cloud") {
  auto rest = std::make_shared<const FixedPose>(person()->skeleton.rest_pose());
  const AvatarActor actor = AvatarActor::create(person(), rest).value();
  std::vector<Affine3<double>> joints;
  actor.joint_matrices(3.0, joints);
  for (const auto& m : joints) {
    CHECK(norm(m.translation) < 1e-12);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) CHECK(std::abs(m.linear(i, j) - (i == j ? 1 : 0)) < 1e-12);
    }
  }
}

TEST_CASE("unusable weights are refused by name") {
  AvatarAsset asset = *person();
  const std::size_t n = asset.size();
  const std::vector<std::uint16_t> zeros(n, 0);
  std::vector<float> ones(n, 1.0f);
  ones[7] = -1;
  CHECK(asset.set_weights(1, zeros, ones).message().find("Gaussian 7 ") != std::string::npos);
  ones[7] = 0;
  CHECK(asset.set_weights(1, zeros, ones).message().find("Gaussian 7 has no weight") !=
        std::string::npos);
  ones[7] = std::nanf("");
  CHECK_FALSE(asset.set_weights(1, zeros, ones).ok());
  ones[7] = 1;
  CHECK(asset.set_weights(1, std::vector<std::uint16_t>(n, 55), ones).message().find("joint 55 of 55") !=
        std::string::npos);
  CHECK_FALSE(asset.set_weights(2, zeros, ones).ok());
  CHECK(asset.set_weights(1, zeros, ones).ok());
  asset.skinning_weights[4] -= 1;
  CHECK(asset.validate().message().find("Gaussian 1") != std::string::npos);
}

TEST_CASE("dense weights keep the four greatest and say what was lost") {
  AvatarAsset asset;
  asset.skeleton = person()->skeleton;
  GaussianCloudBuilder builder(0);
  RawGaussian g;
  g.opacity_logit = 2;
  builder.add(g);
  asset.cloud = builder.cloud();
  const std::vector<float> w{0.05f, 0.30f, 0.10f, 0.25f, 0.02f, 0.28f};
  const std::vector<std::uint16_t> j{0, 1, 2, 3, 4, 5};
  CHECK(asset.set_weights(6, j, w).value() == doctest::Approx(0.07));
  CHECK(asset.joint_indices == std::vector<std::uint16_t>{1, 5, 3, 2});
  CHECK(weight_of_parts(asset.skinning_weights[0]) == doctest::Approx(0.30 / 0.93).epsilon(1e-4));
}

TEST_CASE("rounded weights make 1 and move a point by at most K / 4 parts of its joints' distance") {
  Rng rng(21);
  for (const std::size_t k : {4u, 8u}) {
    double worst = 0;
    for (int i = 0; i < 20000; ++i) {
      std::vector<double> weights(k);
      for (double& w : weights) w = rng.below(5) == 0 ? 0.0 : rng.uniform();
      weights[0] += 0.01;
      // Every second row is the worst there is: each weight half a part from the next whole number.
      if (i % 2 == 0) {
        double left = kWeightParts;
        for (std::size_t j = k; j-- > 1;)
          left -= weights[j] = static_cast<double>(rng.below(4000)) + 0.5;
        weights[0] = left;
      }
      std::sort(weights.begin(), weights.end(), std::greater<>());
      std::vector<std::uint16_t> parts(k);
      round_weights(weights.data(), k, parts.data());
      CHECK(std::is_sorted(parts.begin(), parts.end(), std::greater<>()));
      double sum = 0, reach = 0;
      int all = 0;
      std::vector<Vec3d> places(k);  // where each joint alone puts the point
      Vec3d exact{}, rounded{};
      for (std::size_t j = 0; j < k; ++j) {
        // Two clusters of joints, a metre apart, are what the bound is about.
        places[j] = i % 4 < 2 ? Vec3d{rng.below(2) == 0 ? 0.0 : 1.0, 0, 0}
                              : Vec3d{rng.uniform(), rng.uniform(), rng.uniform()};
        for (std::size_t n = 0; n < j; ++n) reach = std::max(reach, norm(places[j] - places[n]));
        sum += weights[j];
        all += parts[j];
      }
      REQUIRE(all == kWeightParts);
      for (std::size_t j = 0; j < k; ++j) {
        exact += places[j] * (weights[j] / sum);
        rounded += places[j] * (static_cast<double>(parts[j]) / kWeightParts);
      }
      if (reach == 0) continue;
      worst = std::max(worst, norm(rounded - exact) / reach);
    }
    const double bound = static_cast<double>(k) / (4.0 * kWeightParts);
    MESSAGE("K = " << k << ": " << 1e6 * worst << " um a metre, bound " << 1e6 * bound);
    CHECK(worst <= bound * (1 + 1e-9));
    CHECK(worst > 0.9 * bound);
  }
}

TEST_CASE("float against double over a walk, 0 to 5 m from the root") {
  const WalkMotion walk = WalkMotion::create(person()->skeleton).value();
  const auto inverse = person()->skeleton.bind_inverses();
  for (const double away : {0.0, 4.0}) {
    double distance = 0, angle = 0;
    for (int k = 0; k < 8; ++k) {
      LocalPose pose;
      walk.pose(k / 8.0, 1, 0, pose);
      pose.translations[0] += Vec3d{away, 0, 0};
      std::vector<Affine3<double>> joints;
      forward_kinematics(person()->skeleton, pose, joints);
      for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = joints[j] * inverse[j];
      const auto f = skin_all<float, float>(*person(), joints);
      const auto d = skin_all<double, double>(*person(), joints);
      for (std::size_t i = 0; i < person()->size(); ++i) {
        distance = std::max(distance, norm(f.mean(i) - d.mean(i)));
        angle = std::max(angle, angle_between(f.quat(i), d.quat(i)));
      }
    }
    MESSAGE(away << " m away: " << 1e3 * distance << " mm, " << angle << " degrees");
    CHECK(distance <= 2e-5);
    CHECK(angle <= 0.01);
  }
}

TEST_CASE("skinning refuses arrays that do not fit") {
  SerialBackend backend;
  std::vector<float> values(8, 0.5f), out(8);
  std::vector<std::uint16_t> indices(8, 0), weights(8, kWeightParts / 4);
  std::vector<Affine3<float>> joints(1);
  SkinningArgs<float> args;
  for (auto& v : args.means) v = {values.data(), 2};
  for (auto& v : args.quats) v = {values.data(), 2};
  for (auto& v : args.means_out) v = {out.data(), 2};
  for (auto& v : args.quats_out) v = {out.data(), 2};
  args.joint_indices = view_of(indices);
  args.weights = view_of(weights);
  args.joints = view_of(joints);
  CHECK(skin_gaussians<float>(backend, args).ok());
  SkinningArgs<float> bad = args;
  bad.weights.size = 7;
  CHECK(skin_gaussians<float>(backend, bad).message().find("weights") != std::string::npos);
  bad = args;
  bad.influences = 5;
  CHECK(skin_gaussians<float>(backend, bad).message().find("influences is 5") != std::string::npos);
  bad = args;
  bad.rotations_out[0] = {out.data(), 2};
  CHECK(skin_gaussians<float>(backend, bad).message().find("rotations_out") != std::string::npos);
  bad = args;
  bad.joints.size = 0;
  CHECK(skin_gaussians<float>(backend, bad).message().find("joints") != std::string::npos);
}
