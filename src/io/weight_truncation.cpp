// SPDX-License-Identifier: Apache-2.0
#include "weight_truncation.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace gsnav::io::detail {
namespace {

using Influence = std::pair<double, std::size_t>;  // weight, joint

/// Where the influences, divided by their sum, put x.
Vec3d blend(const std::vector<Affine3<double>>& joints, const Influence* begin, const Influence* end, const Vec3d& x) {
  Vec3d sum{};
  double all = 0.0;
  for (const Influence* p = begin; p != end; ++p) {
    sum += (joints[p->second] * x) * p->first;
    all += p->first;
  }
  return sum * (1.0 / all);
}

}  // namespace

Status measure_truncation(const AvatarAsset& asset, const std::vector<double>& weights,
                          const std::vector<std::size_t>& rows, const LoadAvatarOptions& options,
                          WeightReport& report) {
  const std::size_t kept = static_cast<std::size_t>(asset.influences), more = kInfluences8;
  const std::size_t joints = asset.skeleton.size();
  const std::vector<Affine3<double>> binds = asset.skeleton.bind_inverses();
  std::vector<std::vector<Affine3<double>>> poses = options.poses;
  for (auto& pose : poses) {
    if (pose.size() != joints) {
      return {Errc::invalid_argument, "LoadAvatarOptions.poses: a pose of " + std::to_string(pose.size()) +
                                          " joints for " + std::to_string(joints)};
    }
    for (std::size_t j = 0; j < joints; ++j) pose[j] = pose[j] * binds[j];
  }
  report.poses = poses.size();
  std::vector<Influence> all;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    all.clear();
    for (std::size_t j = 0; j < joints; ++j) {
      if (weights[rows[i] * joints + j] > 0) all.emplace_back(weights[rows[i] * joints + j], j);
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
    Influence own[kInfluences8];
    for (std::size_t k = 0; k < kept; ++k) {
      own[k] = {weight_of_parts(asset.skinning_weights[i * kept + k]), asset.joint_indices[i * kept + k]};
    }
    const Vec3d x = asset.cloud.mean(i);
    double worst = 0.0;
    for (const auto& pose : poses) {
      const Influence* end = all.data() + all.size();
      const Vec3d truth = blend(pose, all.data(), end, x);
      worst = max(worst, norm(blend(pose, own, own + kept, x) - truth));
      if (all.size() > more) {
        report.position_error_8 =
            max(report.position_error_8, norm(blend(pose, all.data(), all.data() + more, x) - truth));
      }
    }
    report.position_error = max(report.position_error, worst);
    report.needs_more += worst > options.weight_tolerance ? 1 : 0;
  }
  return {};
}

}  // namespace gsnav::io::detail
