// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/weight_truncation.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsnav {

namespace {

using Influence = std::pair<double, std::size_t>;  // weight, joint

/// Position of x under the influences, whose weights are divided by their sum.
Vec3d blended_place(const std::vector<Affine3<double>>& joints, const Influence* begin,
                    const Influence* end, const Vec3d& x) {
  Vec3d sum{};
  double all = 0.0;
  for (const Influence* p = begin; p != end; ++p) {
    sum += (joints[p->second] * x) * p->first;
    all += p->first;
  }
  return sum * (1.0 / all);
}

/// Fills the position errors of `report` for the present weights of the asset. `poses` are joint
/// matrices.
void measure_truncation(const AvatarAsset& asset, std::size_t k,
                        const std::vector<std::uint16_t>& indices, const std::vector<float>& weights,
                        const std::vector<std::vector<Affine3<double>>>& poses, double tolerance,
                        WeightReport& report) {
  const std::size_t kept = static_cast<std::size_t>(asset.influences), more = kInfluences8;
  report.poses = poses.size();
  report.most_weights = report.needs_more = 0;
  report.position_error = report.position_error_8 = 0.0;
  std::vector<Influence> all;
  for (std::size_t i = 0; i < asset.size(); ++i) {
    all.clear();
    for (std::size_t j = i * k; j < (i + 1) * k; ++j) {
      if (weights[j] > 0) all.emplace_back(static_cast<double>(weights[j]), indices[j]);
    }
    report.most_weights = std::max(report.most_weights, all.size());
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    Influence own[kInfluences8];
    for (std::size_t j = 0; j < kept; ++j) {
      own[j] = {weight_of_parts(asset.skinning_weights[i * kept + j]),
                asset.joint_indices[i * kept + j]};
    }
    const Vec3d x = asset.cloud.mean(i);
    double worst = 0.0;
    for (const auto& pose : poses) {
      const Influence* end = all.data() + all.size();
      const Vec3d truth = blended_place(pose, all.data(), end, x);
      worst = max(worst, norm(blended_place(pose, own, own + kept, x) - truth));
      if (all.size() > more) {
        report.position_error_8 =
            max(report.position_error_8,
                norm(blended_place(pose, all.data(), all.data() + more, x) - truth));
      }
    }
    report.position_error = max(report.position_error, worst);
    report.needs_more += worst > tolerance ? 1 : 0;
  }
}

}  // namespace

Result<WeightReport> choose_weights(AvatarAsset& asset, std::size_t k,
                                    const std::vector<std::uint16_t>& indices,
                                    const std::vector<float>& weights, const WeightOptions& options) {
  const std::size_t joints = asset.skeleton.size();
  if (!(options.tolerance >= 0)) return {Errc::invalid_argument, "WeightOptions.tolerance must be >= 0"};
  const std::vector<Affine3<double>> binds = asset.skeleton.bind_inverses();
  std::vector<std::vector<Affine3<double>>> poses = options.poses;
  for (auto& pose : poses) {
    if (pose.size() != joints) {
      return {Errc::invalid_argument, "WeightOptions.poses: a pose of " + std::to_string(pose.size()) +
                                          " joints for " + std::to_string(joints)};
    }
    to_joint_matrices(pose, binds);
  }
  WeightReport report;
  const auto keep = [&](int influences) -> Status {
    const auto dropped = asset.set_weights(k, indices, weights, influences);
    if (!dropped) return dropped.status();
    report.influences = influences;
    report.dropped_mass = *dropped;
    measure_truncation(asset, k, indices, weights, poses, options.tolerance, report);
    return {};
  };
  if (Status s = keep(options.influences == 0 ? kInfluences4 : options.influences); !s) return s;
  const bool unsure = poses.empty() && report.most_weights > static_cast<std::size_t>(kInfluences4);
  if (options.influences == 0 && report.most_weights > static_cast<std::size_t>(kInfluences4) &&
      (unsure || report.position_error > options.tolerance)) {
    if (Status s = keep(kInfluences8); !s) return s;
  }
  return report;
}

}  // namespace gsnav
