// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "avatar/support.hpp"
#include "avatar_files/bodies.hpp"
#include "gsnav/detail/rigging/mesh_avatar.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Greatest angle by which the float32 orientation is off, degrees, and the share of Gaussians whose
/// blend lies so near to the determinant below which the greatest joint decides that float and double
/// may decide otherwise.
void compare(const char* name, const AvatarAsset& asset,
             const std::vector<std::vector<Affine3<double>>>& poses) {
  double distance = 0, angle = 0;
  std::size_t undecided = 0;
  const std::size_t row = static_cast<std::size_t>(asset.influences);
  for (const auto& pose : poses) {
    const auto joints = times_binds(asset.skeleton, pose);
    const auto f = skin_all<float, float>(asset, joints);
    const auto d = skin_all<double, double>(asset, joints);
    for (std::size_t i = 0; i < asset.size(); ++i) {
      Mat3d blend{};
      for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
        blend =
            blend + joints[asset.joint_indices[k]].linear * weight_of_parts(asset.skinning_weights[k]);
      }
      distance = std::max(distance, norm(f.mean(i) - d.mean(i)));
      if (std::abs(determinant(blend) - kMinBlendDeterminant) < 1e-4) {
        ++undecided;
      } else {
        angle = std::max(angle, angle_between(f.quat(i), d.quat(i)));
      }
    }
  }
  std::printf(
      "%s: float32 skinning is off by %.5f mm and %.6f degrees at most in %zu poses (%zu undecided)\n",
      name, 1e3 * distance, angle, poses.size(), undecided);
  CHECK(distance <= 2e-5);
  CHECK(angle <= 0.01);
  CHECK(undecided < asset.size() / 1000);
}

}  // namespace

TEST_CASE("real bodies are skinned to 0.02 mm and 0.01 degrees") {
  MeshAvatarOptions options;
  options.gaussians = 20000;
  for (const char* name : {"lumberjack.glb", "cesium_man.gltf"}) {
    const TestBody body = gltf_body(name);
    if (!body.ok) continue;
    const AvatarAsset asset = make_mesh_avatar(body.loaded.mesh, options).value().asset;
    for (const auto& clip : body.loaded.clips)
      compare(name, asset, poses_of(asset.skeleton, clip.clip, 8));
  }
  const TestBody body = makehuman_body("female");
  if (!body.ok) return;
  const AvatarAsset asset = make_mesh_avatar(body.loaded.mesh, options).value().asset;
  Rng rng(6);
  std::vector<std::vector<Affine3<double>>> poses;
  for (int k = 0; k < 6; ++k) {
    LocalPose pose = body.loaded.pose;
    for (Quatd& q : pose.rotations) q = q * rotation_within(rng, 25);
    poses.push_back(joints_at(asset.skeleton, pose));
  }
  compare("makehuman, every joint turned", asset, poses);
}
