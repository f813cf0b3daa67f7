// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>

#include "file.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/frame/sh.hpp"

namespace gsnav::io {
namespace {

template <std::size_t K>
std::vector<float> interleaved(const std::array<std::vector<float>, K>& planes, std::size_t n) {
  std::vector<float> out(n * K);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < K; ++k) out[i * K + k] = planes[k][i];
  }
  return out;
}

/// Whether a reader that only knows the trees of 24 and 55 joints would find this one.
bool known_joints(const Skeleton& skeleton) {
  const BodyJoints known = body_joints(skeleton.size());
  return !known.names.empty() &&
         std::equal(known.names.begin(), known.names.end(), skeleton.names.begin()) &&
         std::equal(known.parents.begin(), known.parents.end(), skeleton.parents.begin());
}

}  // namespace

Status save_avatar(const std::filesystem::path& path, const AvatarAsset& asset) {
  return detail::guarded(path.string(), [&]() -> Status {
    if (Status s = asset.validate(); !s) return {s.code(), path.string() + ": " + s.message()};
    const GaussianCloud& cloud = asset.cloud;
    const Skeleton& skeleton = asset.skeleton;
    const std::size_t n = asset.size(), joints = skeleton.size();
    const std::vector<float> means = interleaved(cloud.means, n), scales = interleaved(cloud.scales, n),
                             quats = interleaved(cloud.quats, n);
    std::vector<float> weights(n * joints, 0.0f);
    for (std::size_t k = 0; k < asset.joint_indices.size(); ++k) {
      weights[k / static_cast<std::size_t>(asset.influences) * joints + asset.joint_indices[k]] +=
          skinning_weight<float>(asset.skinning_weights[k]);
    }
    std::vector<double> binds;
    for (const Affine3<double>& m : skeleton.bind_inverses()) {
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) binds.push_back(m.linear(i, k));
        binds.push_back(m.translation[i]);
      }
      binds.insert(binds.end(), {0.0, 0.0, 0.0, 1.0});
    }
    std::vector<NpzEntry> entries{{"means", {n, 3}, means},
                                  {"scales", {n, 3}, scales},
                                  {"quats", {n, 4}, quats},
                                  {"opacities", {n}, cloud.opacities},
                                  {"lbs_weights", {n, joints}, weights},
                                  {"joints_inv_bind_matrix", {joints, 4, 4}, binds}};
    std::vector<float> sh;
    std::vector<double> rgb;
    const auto coefficients = static_cast<std::size_t>(sh_coefficient_count(cloud.sh_degree));
    const bool looks_like_rgb =
        cloud.sh_degree == 0 &&
        std::all_of(cloud.sh0.begin(), cloud.sh0.end(), [](float v) { return v >= 0 && v <= 1; });
    if (looks_like_rgb) {
      for (const float v : cloud.sh0) rgb.push_back(color_of_sh0(static_cast<double>(v)));
      entries.push_back({"shs", {n, 3}, rgb});
    } else {
      const std::size_t rest = 3 * (coefficients - 1);
      for (std::size_t i = 0; i < n; ++i) {
        sh.insert(sh.end(), cloud.sh0.begin() + static_cast<std::ptrdiff_t>(3 * i),
                  cloud.sh0.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
        sh.insert(sh.end(), cloud.shN.begin() + static_cast<std::ptrdiff_t>(rest * i),
                  cloud.shN.begin() + static_cast<std::ptrdiff_t>(rest * (i + 1)));
      }
      entries.push_back({"shs", {n, coefficients, 3}, sh});
    }
    const std::vector<std::int64_t> parents(skeleton.parents.begin(), skeleton.parents.end());
    if (!known_joints(skeleton)) {
      std::string names;
      for (const std::string& name : skeleton.names) names += (names.empty() ? "" : "\n") + name;
      entries.push_back({"joint_names", {}, names});
      entries.push_back({"joint_parents", {joints}, parents});
    }
    std::vector<std::int64_t> capsule_joints;
    std::vector<double> capsules;
    for (const ProxyCapsule& c : asset.capsules) {
      capsule_joints.push_back(c.joint);
      capsules.insert(capsules.end(), {c.p0.x, c.p0.y, c.p0.z, c.p1.x, c.p1.y, c.p1.z, c.radius});
    }
    if (!capsules.empty()) {
      entries.push_back({"capsule_joints", {capsule_joints.size()}, capsule_joints});
      entries.push_back({"capsules", {capsule_joints.size(), 7}, capsules});
    }
    const std::vector<std::int64_t> skinning{static_cast<std::int64_t>(asset.skinning)};
    if (asset.skinning != Skinning::linear) entries.push_back({"skinning", {1}, skinning});
    return save_npz(path, entries);
  });
}

}  // namespace gsnav::io
