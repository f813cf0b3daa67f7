// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "avatar/support.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

struct Blend {
  Affine3<double> joints[kInfluences];
  double weights[kInfluences] = {};
};

/// 2 to 4 joints at most `degrees` away from one of them, weights sorted.
Blend random_blend(Rng& rng, double degrees) {
  Blend b;
  const Quatd base = random_rotation(rng);
  const std::size_t n = 2 + rng.below(3);
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) sum += b.weights[k] = rng.uniform(0.02, 1.0);
  for (double& w : b.weights) w /= sum;
  std::sort(b.weights, b.weights + kInfluences, std::greater<>());
  for (std::size_t k = 0; k < kInfluences; ++k) {
    const Quatd q = k == 0 ? base : rotation_within(rng, degrees) * base;
    b.joints[k] = {rotation_matrix(q), {rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)}};
  }
  return b;
}

template <class S>
Skinned<S> skin_blend(const Blend& b, const Vec3d& mean, const Quatd& quat) {
  Affine3<S> joints[kInfluences];
  S weights[kInfluences];
  for (int k = 0; k < kInfluences; ++k) {
    joints[k] = affine_cast<S>(b.joints[k]);
    weights[k] = static_cast<S>(b.weights[k]);
  }
  return skin<S>(joints, weights, vec_cast<S>(mean), quat_cast<S>(quat));
}

Mat3d blended(const Blend& b) {
  Mat3d m{};
  for (int k = 0; k < kInfluences; ++k) m = m + b.joints[k].linear * b.weights[k];
  return m;
}

Mat3d covariance(const Quatd& q, const Vec3d& s) {
  const Mat3d r = rotation_matrix(q);
  Mat3d m = r;
  for (int i = 0; i < 3; ++i) m.row[i] = {r(i, 0) * s.x, r(i, 1) * s.y, r(i, 2) * s.z};
  return m * transpose(m);
}

}  // namespace

TEST_CASE("identity joints leave the canonical pose") {
  const std::vector<Affine3<double>> joints(55);
  const auto out = skin_all<float, float>(*person(), joints);
  double distance = 0, angle = 0;
  for (std::size_t i = 0; i < person()->size(); ++i) {
    distance = std::max(distance, norm(out.mean(i) - person()->cloud.mean(i)));
    const auto& q = person()->cloud.quats;
    angle = std::max(angle, angle_between(out.quat(i), {static_cast<double>(q[0][i]), static_cast<double>(q[1][i]),
                                                        static_cast<double>(q[2][i]), static_cast<double>(q[3][i])}));
  }
  CHECK(distance <= 1e-6);
  CHECK(angle <= 1e-4);
}

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

TEST_CASE("weights are renormalised at load, so a far root costs nothing") {
  AvatarAsset asset;
  asset.skeleton.names = {"a", "b", "c"};
  asset.skeleton.parents = {-1, 0, 1};
  asset.skeleton.rest_local.resize(3);
  Rng rng(5);
  GaussianCloudBuilder builder(0);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  for (int i = 0; i < 500; ++i) {
    RawGaussian g;
    g.mean = {rng.uniform(-1, 1), rng.uniform(0, 2), rng.uniform(-1, 1)};
    g.quat = random_rotation(rng);
    g.opacity_logit = 2;
    builder.add(g);
    double w[3] = {rng.uniform(), rng.uniform(), rng.uniform()};
    const double sum = (w[0] + w[1] + w[2]) / (1 + rng.uniform(-1e-3, 1e-3));
    for (std::uint16_t k = 0; k < 3; ++k) {
      indices.push_back(k);
      weights.push_back(static_cast<float>(w[k] / sum));
    }
  }
  asset.cloud = builder.cloud();
  CHECK(asset.set_weights(3, indices, weights).value() < 1e-9);
  CHECK(asset.validate().ok());
  for (std::size_t i = 0; i < asset.size(); ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += static_cast<double>(asset.skinning_weights[4 * i + k]);
    CHECK(std::abs(sum - 1) < 1.2e-7);
  }
  // The root goes 1000 m away: placement in double, joint matrices relative to it.
  MotionClip clip;
  clip.joints = 3;
  clip.rotations.assign(3, Quatd{});
  clip.translations.assign(3, Vec3d{});
  clip.root_translation = {{0, 0, -1000}};
  const Similarity turn{axis_angle(Vec3d{0, 1, 0}, 0.7), {3, 0, 0}, 1};
  auto shared = std::make_shared<const AvatarAsset>(std::move(asset));
  const AvatarActor actor = AvatarActor::create(shared, std::make_shared<const MotionClip>(clip),
                                                std::make_shared<const StandingTrajectory>(turn.translation, 0.7)).value();
  SerialBackend backend;
  SkinnedGaussians<SerialBackend> skinned(backend, shared);
  skinned.pose(actor, 0).throw_if_error();
  const GaussianSet set = skinned.set();
  const Similarity all = turn * Similarity{{}, {0, 0, -1000}, 1};
  double worst = 0;
  for (std::size_t i = 0; i < shared->size(); ++i) {
    const GaussianView& v = set.gaussians;
    const Vec3d p = vec_cast<double>(Vec3f{v.means[0][i], v.means[1][i], v.means[2][i]});
    worst = std::max(worst, norm(set.world_from_asset * p - all * shared->cloud.mean(i)));
  }
  CHECK(worst <= 1e-5);
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

TEST_CASE("candy wrapper: at 180 degrees the joint of the greatest weight gives the rotation") {
  for (const double second : {0.5, 0.499, 0.45}) {
    Blend b;
    b.weights[0] = 1 - second;
    b.weights[1] = second;
    const Quatd first = axis_angle(normalized(Vec3d{1, 2, 3}), 0.4);
    b.joints[0].linear = rotation_matrix(first);
    b.joints[1].linear = rotation_matrix(first * axis_angle(Vec3d{0, 1, 0}, 3.14159265358979323846));
    for (int k = 2; k < kInfluences; ++k) b.joints[k] = b.joints[0];
    REQUIRE(determinant(blended(b)) < kMinBlendDeterminant);
    const Skinned<float> s = skin_blend<float>(b, {0.1, 0.2, 0.3}, {});
    CHECK(is_finite(s.mean));
    CHECK(angle_between(quat_cast<double>(s.rotation), first) < 2e-5);
  }
}

TEST_CASE_TEMPLATE("rotation is the polar factor of the blend", S, float, double) {
  Rng rng(11);
  double worst = 0, worst_mean = 0;
  std::size_t tested = 0, fallback = 0;
  for (int n = 0; n < 120000; ++n) {
    const Blend b = random_blend(rng, 120);
    const Vec3d mean{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
    const Skinned<S> s = skin_blend<S>(b, mean, {});
    const Mat3d m = blended(b);
    const double d = determinant(m);
    if (std::abs(d - kMinBlendDeterminant) < 1e-5) continue;
    const Mat3d want = d > kMinBlendDeterminant ? polar_oracle(m) : b.joints[0].linear;
    ++(d > kMinBlendDeterminant ? tested : fallback);
    worst = std::max(worst, angle_between(quat_cast<double>(s.rotation), quat_from_matrix(want)));
    Vec3d at{};
    for (int k = 0; k < kInfluences; ++k) at += (b.joints[k] * mean) * b.weights[k];
    worst_mean = std::max(worst_mean, norm(vec_cast<double>(s.mean) - at));
  }
  MESSAGE(tested << " blends, " << fallback << " without orientation: worst " << worst << " degrees, mean "
                 << 1e3 * worst_mean << " mm");
  CHECK(tested > 100000);
  CHECK(worst <= (sizeof(S) == 4 ? 1e-3 : 1e-6));  // the budget is 0.01
  CHECK(worst_mean <= (sizeof(S) == 4 ? 1e-6 : 1e-14));
}

TEST_CASE("numbering the ellipsoid's axes otherwise gives the same covariance") {
  Rng rng(13);
  double worst = 0;
  // Turned by 90 degrees about one axis, the scales of the other two change places.
  const double r = std::sqrt(0.5);
  const Quatd turns[3] = {{r, r, 0, 0}, {r, 0, r, 0}, {r, 0, 0, r}};
  for (int n = 0; n < 3000; ++n) {
    const Blend b = random_blend(rng, 120);
    const Quatd q = random_rotation(rng);
    const Vec3d s{rng.uniform(0.01, 0.1), rng.uniform(0.01, 0.1), rng.uniform(0.001, 0.1)};
    const Vec3d permuted[3] = {{s.x, s.z, s.y}, {s.z, s.y, s.x}, {s.y, s.x, s.z}};
    const Mat3d a = covariance(quat_cast<double>(skin_blend<float>(b, {}, q).quat), s);
    for (int k = 0; k < 3; ++k) {
      const Mat3d c = covariance(quat_cast<double>(skin_blend<float>(b, {}, q * turns[k]).quat), permuted[k]);
      for (int i = 0; i < 3; ++i) worst = std::max(worst, norm(a.row[i] - c.row[i]) / 0.01);
    }
  }
  CHECK(worst <= 1e-5);
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
