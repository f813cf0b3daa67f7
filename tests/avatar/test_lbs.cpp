// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
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
  CHECK(asset.set_weights(1, zeros, ones).message().find("Gaussian 7 has no weight") != std::string::npos);
  ones[7] = std::nanf("");
  CHECK_FALSE(asset.set_weights(1, zeros, ones).ok());
  ones[7] = 1;
  CHECK(asset.set_weights(1, std::vector<std::uint16_t>(n, 55), ones).message().find("joint 55 of 55") != std::string::npos);
  CHECK_FALSE(asset.set_weights(2, zeros, ones).ok());
  CHECK(asset.set_weights(1, zeros, ones).ok());
  asset.skinning_weights[4] = 0.9f;
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
  CHECK(static_cast<double>(asset.skinning_weights[0]) == doctest::Approx(0.30 / 0.93));
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
  std::vector<std::uint16_t> indices(8, 0);
  std::vector<Affine3<float>> joints(1);
  SkinningArgs<float> args;
  for (auto& v : args.means) v = {values.data(), 2};
  for (auto& v : args.quats) v = {values.data(), 2};
  for (auto& v : args.means_out) v = {out.data(), 2};
  for (auto& v : args.quats_out) v = {out.data(), 2};
  args.joint_indices = view_of(indices);
  args.weights = view_of(values);
  args.joints = view_of(joints);
  CHECK(skin_gaussians<float>(backend, args).ok());
  SkinningArgs<float> bad = args;
  bad.weights.size = 7;
  CHECK(skin_gaussians<float>(backend, bad).message().find("weights") != std::string::npos);
  bad = args;
  bad.rotations_out[0] = {out.data(), 2};
  CHECK(skin_gaussians<float>(backend, bad).message().find("rotations_out") != std::string::npos);
  bad = args;
  bad.joints.size = 0;
  CHECK(skin_gaussians<float>(backend, bad).message().find("joints") != std::string::npos);
}
