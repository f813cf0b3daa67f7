// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "avatar/support.hpp"
#include "gsnav/detail/avatar/weight_gradients.hpp"
#include "gsnav/detail/rigging/proxy_fit.hpp"
#if defined(_OPENMP)
#include "gsnav/backends/openmp.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr double kPi = 3.14159265358979323846;

double greatest(const Mat3d& m) {
  double out = 0;
  for (const auto& r : m.row) out = std::max({out, std::abs(r.x), std::abs(r.y), std::abs(r.z)});
  return out;
}
Mat3d minus(const Mat3d& a, const Mat3d& b) { return a + b * -1.0; }

Quatd quat_of(const AvatarAsset& a, std::size_t i) {
  return quat_cast<double>(
      Quatf{a.cloud.quats[0][i], a.cloud.quats[1][i], a.cloud.quats[2][i], a.cloud.quats[3][i]});
}
Vec3d scales_of(const AvatarAsset& a, std::size_t i) {
  return vec_cast<double>(Vec3f{a.cloud.scales[0][i], a.cloud.scales[1][i], a.cloud.scales[2][i]});
}

/// A limb along X, 4 cm thick, of flat Gaussians: joint 1 at the middle takes over within 6 cm to either
/// side.
AvatarAsset limb() {
  AvatarAsset asset;
  asset.skeleton.names = {"upper", "lower"};
  asset.skeleton.parents = {-1, 0};
  asset.skeleton.rest_local.resize(2);
  asset.skeleton.rest_local[1].translation = {0.3, 0, 0};
  GaussianCloudBuilder builder(0);
  std::vector<std::uint16_t> indices;
  std::vector<float> weights;
  constexpr int kAround = 60, kAlong = 140;
  for (int k = 0; k < kAlong; ++k) {
    for (int a = 0; a < kAround; ++a) {
      const double angle = 2 * kPi * (a + 0.5 * (k % 2)) / kAround, x = 0.6 * (k + 0.5) / kAlong;
      RawGaussian g =
          gaussian({x, 0.04 * std::cos(angle), 0.04 * std::sin(angle)}, {0.0005, 0.003, 0.003}, 0.9);
      // Its thin axis points outwards.
      g.quat = axis_angle(Vec3d{1, 0, 0}, angle) * axis_angle(Vec3d{0, 0, 1}, kPi / 2);
      builder.add(g);
      const double w = std::clamp((x - 0.24) / 0.12, 0.0, 1.0);
      indices.insert(indices.end(), {0, 1});
      weights.insert(weights.end(), {static_cast<float>(1 - w), static_cast<float>(w)});
    }
  }
  asset.cloud = builder.cloud();
  asset.set_weights(2, indices, weights).value();
  return asset;
}

std::vector<Affine3<double>> joint_matrices(const AvatarAsset& asset, const LocalPose& pose) {
  std::vector<Affine3<double>> joints;
  forward_kinematics(asset.skeleton, pose, joints);
  const auto inverse = asset.skeleton.bind_inverses();
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = joints[j] * inverse[j];
  return joints;
}
std::vector<Affine3<double>> bent(const AvatarAsset& asset, const Vec3d& axis, double degrees) {
  LocalPose pose = asset.skeleton.rest_pose();
  pose.rotations[1] = axis_angle(axis, degrees * kPi / 180);
  return joint_matrices(asset, pose);
}

/// d(skinned place) / d(canonical place) of `limb`, by hand: the weight of joint 1 is linear over 12 cm.
Mat3d true_derivative(const std::vector<Affine3<double>>& joints, const Vec3d& p) {
  const double w = std::clamp((p.x - 0.24) / 0.12, 0.0, 1.0);
  Mat3d f = joints[0].linear * (1 - w) + joints[1].linear * w;
  const Vec3d apart = joints[1] * p - joints[0] * p;
  if (w > 0 && w < 1) {
    for (int r = 0; r < 3; ++r) f.row[r].x += apart[r] / 0.12;
  }
  return f;
}

}  // namespace

TEST_CASE(
    "singular values: the factors are rotations, the product is the matrix, also near rank one and "
    "folded over") {
  Rng rng(3);
  double worst = 0, worst_float = 0;
  for (int i = 0; i < 4000; ++i) {
    Mat3d m;
    for (auto& r : m.row) r = {rng.normal(), rng.normal(), rng.normal()};
    if (i % 4 == 1) m = m * 1e-6;
    if (i % 4 == 2) m.row[2] = m.row[0] * 2.0 + m.row[1] * (1e-7 * rng.normal());
    if (i % 4 == 3) m.row[1] = m.row[0] * 0.5, m.row[2] = m.row[0] * -3.0;
    if (i == 4) m = Mat3d{};
    const auto check = [&](const auto& d, double& at) {
      const double size = std::max(greatest(m), 1e-30);
      Mat3d product{}, left, right;
      for (int k = 0; k < 3; ++k) {
        for (int r = 0; r < 3; ++r) {
          left(r, k) = static_cast<double>(d.left[k][r]);
          right(r, k) = static_cast<double>(d.right[k][r]);
          for (int c = 0; c < 3; ++c) {
            product(r, c) += static_cast<double>(d.values[k]) * static_cast<double>(d.left[k][r]) *
                             static_cast<double>(d.right[k][c]);
          }
        }
      }
      at = std::max(at, greatest(minus(product, m)) / size);
      at = std::max(at, greatest(minus(transpose(left) * left, Mat3d::identity())));
      at = std::max(at, greatest(minus(transpose(right) * right, Mat3d::identity())));
      CHECK(determinant(left) > 0);
      CHECK(determinant(right) > 0);
      CHECK(d.values[0] >= d.values[1]);
      CHECK(d.values[1] >= std::abs(d.values[2]) * (1 - 1e-5));
    };
    check(svd(m), worst);
    check(svd(mat_cast<float>(m)), worst_float);
  }
  MESSAGE("off by " << worst << " in double, " << worst_float << " in float");
  CHECK(worst < 1e-13);
  CHECK(worst_float < 2e-5);
}

TEST_CASE(
    "dual quaternions of joints that differ by a translation give exactly what linear blending gives") {
  AvatarAsset asset = limb();
  const Quatd turn = axis_angle(normalized(Vec3d{1, 2, 3}), 2.5);
  const std::vector<Affine3<double>> joints{{rotation_matrix(turn), {0.3, -0.2, 1.1}},
                                            {rotation_matrix(turn), {0.1, 0.4, -0.7}}};
  const auto linear = skin_all<double, double>(asset, joints);
  asset.skinning = Skinning::dual_quaternion;
  const auto dual = skin_all<double, double>(asset, joints);
  const auto single = skin_all<float, float>(asset, joints);
  for (std::size_t i = 0; i < asset.size(); ++i) {
    REQUIRE(norm(dual.mean(i) - linear.mean(i)) < 1e-14);
    REQUIRE(norm(single.mean(i) - linear.mean(i)) < 1e-6);
    REQUIRE(angle_between(dual.quat(i), linear.quat(i)) < 1e-5);  // canonical quaternions are float
  }
}

TEST_CASE("a twisted limb keeps its width with dual quaternions and collapses without") {
  AvatarAsset asset = limb();
  for (const double degrees : {60.0, 120.0, 179.0}) {
    const auto joints = bent(asset, {1, 0, 0}, degrees);
    const auto linear = skin_all<double, double>(asset, joints);
    asset.skinning = Skinning::dual_quaternion;
    const auto dual = skin_all<float, float>(asset, joints);
    asset.skinning = Skinning::linear;
    double thinnest = 1, linear_thinnest = 1;
    for (std::size_t i = 0; i < asset.size(); ++i) {
      const Vec3d p = dual.mean(i), q = linear.mean(i), c = asset.cloud.mean(i);
      CHECK(std::abs(std::hypot(p.y, p.z) - 0.04) < 1e-6);
      CHECK(std::abs(p.x - c.x) < 1e-6);
      // Twisted along X by w of the whole, at the place's own weight.
      const double w =
          weight_of_parts(asset.skinning_weights[4 * i + (asset.joint_indices[4 * i] == 1 ? 0 : 1)]);
      const double half = degrees * kPi / 360;
      // DLB: the angle whose half's tangent is the blend's.
      const double turned = 2 * std::atan2(w * std::sin(half), 1 - w + w * std::cos(half));
      const Vec3d want = rotate(axis_angle(Vec3d{1, 0, 0}, turned), c);
      CHECK(norm(p - want) < 1e-6);
      thinnest = std::min(thinnest, std::hypot(p.y, p.z));
      linear_thinnest = std::min(linear_thinnest, std::hypot(q.y, q.z));
    }
    CHECK(linear_thinnest < 0.04 * std::cos(degrees * kPi / 360) * 1.05 + 2e-3);
  }
}

TEST_CASE("it does not matter which of its two quaternions a joint has") {
  Rng rng(8);
  const AvatarAsset asset = limb();
  const auto joints = bent(asset, normalized(Vec3d{1, 1, 0}), 150);
  SkinningArgs<double, double> args;
  args.influences = asset.influences;
  args.joint_indices = view_of(asset.joint_indices);
  args.weights = view_of(asset.skinning_weights);
  std::vector<DualQuat<double>> duals{dual_quat(joints[0]), dual_quat(joints[1])};
  const auto place = [&](std::size_t i) {
    args.dual_joints = view_of(duals);
    return skin(blended_dual(args, i), asset.cloud.mean(i), Quatd{}).mean;
  };
  for (std::size_t i = 0; i < asset.size(); i += 7) {
    const Vec3d before = place(i);
    for (const std::size_t j : {0u, 1u}) {
      duals[j] = {-duals[j].real, -duals[j].dual};
      REQUIRE(norm(place(i) - before) < 1e-14);
    }
  }
}

TEST_CASE("stretched shapes are pushed forward by the skin's own derivative") {
  AvatarAsset asset = limb();
  bake_weight_gradients(asset).throw_if_error();
  REQUIRE(asset.validate().ok());
  // Gradients of a weight that is linear along X, 8.3 a metre, away from where it begins and ends.
  for (std::size_t i = 0; i < asset.size(); ++i) {
    const double x = asset.cloud.mean(i).x;
    const bool within = x > 0.26 && x < 0.34;
    if (!within && x > 0.22 && x < 0.38) continue;
    const double sign = asset.joint_indices[4 * i] == 0 ? 1 : -1;
    const Vec3d g{asset.weight_gradients[9 * i], asset.weight_gradients[9 * i + 1],
                  asset.weight_gradients[9 * i + 2]};
    CHECK(norm(g - Vec3d{within ? sign / 0.12 : 0.0, 0, 0}) < 0.02 / 0.12);
  }
  for (const double degrees : {30.0, 60.0, 90.0}) {
    const auto joints = bent(asset, {0, 0, 1}, degrees);
    const auto d = skin_all<double, double>(asset, joints);
    const auto f = skin_all<float, float>(asset, joints);
    double worst = 0, turned_only = 0, rounding = 0;
    std::size_t clamped = 0, checked = 0;
    for (std::size_t i = 0; i < asset.size(); ++i) {
      const Vec3d p = asset.cloud.mean(i), s = scales_of(asset, i);
      if (std::abs(p.x - 0.24) < 0.02 || std::abs(p.x - 0.36) < 0.02)
        continue;  // the weight has a kink there
      const Mat3d derivative = true_derivative(joints, p);
      const auto axes = [&](const Mat3d& m, const Quatd& q) {
        Mat3d r = m * rotation_matrix(q);
        for (auto& row : r.row) row = {row.x * s.x, row.y * s.y, row.z * s.z};
        return r * transpose(r);
      };
      const Mat3d want = axes(derivative, quat_of(asset, i));
      const Mat3d have = d.factor(i) * transpose(d.factor(i)),
                  single = f.factor(i) * transpose(f.factor(i));
      rounding = std::max(rounding, greatest(minus(single, have)) / greatest(have));
      const Svd3<double> e = svd(derivative);
      if (e.values[2] < 0.5 || e.values[0] > 2) {
        ++clamped;
        continue;
      }
      ++checked;
      worst = std::max(worst, greatest(minus(have, want)) / greatest(want));
      turned_only = std::max(turned_only,
                             greatest(minus(axes(Mat3d::identity(), d.quat(i)), want)) / greatest(want));
    }
    MESSAGE(degrees << " degrees: " << 100 * worst << " % of the covariance off, " << 100 * turned_only
                    << " % with the rotation alone; float " << rounding << ", " << clamped
                    << " clamped");
    CHECK(checked > asset.size() / 2);
    CHECK(worst < 0.03);
    CHECK(turned_only > 5 * worst);
    CHECK(rounding < 1e-5);
  }
}

TEST_CASE("stretch stays within its bounds where the skin collapses or folds over") {
  AvatarAsset asset = limb();
  bake_weight_gradients(asset).throw_if_error();
  for (const double degrees : {90.0, 120.0, 150.0, 180.0}) {
    for (const Vec3d& axis : {Vec3d{0, 0, 1}, Vec3d{1, 0, 0}}) {
      const auto skinned = skin_all<float, float>(asset, bent(asset, axis, degrees));
      for (std::size_t i = 0; i < asset.size(); ++i) {
        // The factor is clamped F times rotation times scales: undo the scales.
        Mat3d f = skinned.factor(i);
        const Vec3d s = scales_of(asset, i);
        for (auto& row : f.row) row = {row.x / s.x, row.y / s.y, row.z / s.z};
        const Svd3<double> e = svd(f);
        REQUIRE(e.values[2] > kLeastStretch * (1 - 1e-4));
        REQUIRE(e.values[0] < kGreatestStretch * (1 + 1e-4));
      }
    }
  }
}

TEST_CASE(
    "modes: every backend gives the same bits, a crowd those of its members, and unfit arrays are "
    "named") {
  for (const Skinning mode : {Skinning::dual_quaternion, Skinning::linear_stretched}) {
    AvatarAsset asset = limb();
    if (mode == Skinning::linear_stretched) bake_weight_gradients(asset).throw_if_error();
    asset.skinning = mode;
    const auto shared = std::make_shared<const AvatarAsset>(asset);
    LocalPose pose = asset.skeleton.rest_pose();
    pose.rotations[1] = axis_angle(Vec3d{0, 1, 0}, 1.4);
    const AvatarActor actor =
        AvatarActor::create(shared, std::make_shared<const FixedPose>(pose)).value();
    const auto want = skin_all<float, float>(asset, joint_matrices(asset, pose));
#if defined(_OPENMP)
    OpenMPBackend backend(3);
#else
    SerialBackend backend;
#endif
    using B = decltype(backend);
    SkinnedGaussians<B> alone(backend, shared);
    alone.pose(actor, 0).throw_if_error();
    SkinnedCrowd<B> crowd(backend);
    const auto plain = std::make_shared<const AvatarAsset>(limb());
    const std::vector<AvatarActor> people{AvatarActor::create(plain).value(), actor};
    for (const auto& a : people) crowd.add(a.asset());
    crowd.pose(people, 0).throw_if_error();
    for (const ShapeRows& v : {alone.set().gaussians.shape, crowd.set(1).gaussians.shape}) {
      for (std::size_t i = 0; i < asset.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) REQUIRE(v.means[k][i] == want.means[k][i]);
        for (std::size_t k = 0; k < 4; ++k) REQUIRE(v.quats[k][i] == want.quats[k][i]);
        for (std::size_t k = 0; k < 9 && mode == Skinning::linear_stretched; ++k)
          REQUIRE(v.axes[k][i] == want.axes[k][i]);
      }
      CHECK(v.axes.empty() == (mode != Skinning::linear_stretched));
    }
    CHECK(crowd.set(0).gaussians.shape.axes.empty());
  }
  AvatarAsset asset = limb();
  asset.skinning = Skinning::linear_stretched;
  CHECK(asset.validate().message().find("bake_weight_gradients") != std::string::npos);
  asset = limb();
  CHECK(bake_weight_gradients(asset, {3}).message().find("neighbours is 3") != std::string::npos);
  bake_weight_gradients(asset).throw_if_error();
  asset.weight_gradients[90] = std::nanf("");
  CHECK(asset.validate().message().find("weight_gradients of Gaussian 10") != std::string::npos);
  SerialBackend backend;
  SkinningArgs<float> args;
  std::vector<DualQuat<float>> duals(1);
  const std::vector<float> gradients(9, 0.0f);
  args.dual_joints = view_of(duals);
  args.weight_gradients = view_of(gradients);
  CHECK(skin_gaussians<float>(backend, args).message().find("linear blending") != std::string::npos);
  args.dual_joints = {};
  CHECK(skin_gaussians<float>(backend, args).message().find("weight_gradients has 9") !=
        std::string::npos);
}

TEST_CASE("the box of a body holds it in every mode") {
  Rng rng(12);
  AvatarAsset asset = *person();
  for (const Skinning mode : {Skinning::linear, Skinning::dual_quaternion}) {
    asset.skinning = mode;
    const BodyBounds bounds(asset);
    for (int k = 0; k < 4; ++k) {
      LocalPose pose = asset.skeleton.rest_pose();
      for (Quatd& q : pose.rotations) q = q * rotation_within(rng, 120);
      std::vector<Affine3<double>> globals;
      forward_kinematics(asset.skeleton, pose, globals);
      const ChunkBounds box = bounds.at(globals);
      const auto binds = asset.skeleton.bind_inverses();
      const auto centers = skinned_centers(asset, globals);
      for (std::size_t j = 0; j < binds.size(); ++j) globals[j] = globals[j] * binds[j];
      const auto skinned = skin_all<float, float>(asset, globals);
      for (std::size_t i = 0; i < asset.size(); ++i) {
        const Vec3d p = skinned.mean(i);
        REQUIRE(norm(p - centers[i]) < 2e-5);
        for (int c = 0; c < 3; ++c) REQUIRE((p[c] >= box.low[c] && p[c] <= box.high[c]));
      }
    }
  }
}
