// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/proxy_fit.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "gsnav/detail/skin/skin_modes.hpp"

namespace gsnav {

std::vector<Vec3d> skinned_centers(const AvatarAsset& asset, std::vector<Affine3<double>> globals) {
  to_joint_matrices(globals, asset.skeleton.bind_inverses());
  std::vector<DualQuat<double>> duals;
  if (asset.skinning == Skinning::dual_quaternion) {
    for (const Affine3<double>& m : globals) duals.push_back(dual_quat(m));
  }
  SkinningArgs<double, double> args;
  args.influences = asset.influences;
  args.joint_indices = view_of(asset.joint_indices);
  args.weights = view_of(asset.skinning_weights);
  args.dual_joints = view_of(std::as_const(duals));
  const std::size_t row = static_cast<std::size_t>(asset.influences);
  std::vector<Vec3d> out(asset.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3d p = asset.cloud.mean(i);
    if (!duals.empty()) {
      out[i] = skin(blended_dual(args, i), p, Quatd{}).mean;
      continue;
    }
    // Sums points, not joints as the kernels do: capsules of people that were made before keep their
    // bits.
    for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
      if (asset.skinning_weights[k] > 0)
        out[i] += (globals[asset.joint_indices[k]] * p) * weight_of_parts(asset.skinning_weights[k]);
    }
  }
  return out;
}

void fit_capsules(AvatarAsset& asset, const std::vector<std::vector<Affine3<double>>>& poses,
                  double percentile) {
  const std::vector<Affine3<double>> rest = asset.skeleton.rest_globals();
  std::vector<ProxyCapsule>& capsules = asset.capsules;
  std::vector<std::vector<std::size_t>> members(capsules.size());
  for (std::size_t i = 0; i < asset.size(); ++i) {
    const Vec3d p = asset.cloud.mean(i);
    double best = std::numeric_limits<double>::max();
    std::size_t to = 0;
    for (std::size_t c = 0; c < capsules.size(); ++c) {
      const Affine3<double>& g = rest[capsules[c].joint];
      // Subtract the radius, so that wide parts keep their points: distances count from the capsule's
      // given surface.
      const double d = capsule_distance({g * capsules[c].p0, g * capsules[c].p1, capsules[c].radius}, p);
      if (d < best) {
        best = d;
        to = c;
      }
    }
    members[to].push_back(i);
  }
  std::vector<std::vector<Vec3d>> centers;
  for (const auto& pose : poses) centers.push_back(skinned_centers(asset, pose));
  std::vector<ProxyCapsule> fitted;
  for (std::size_t c = 0; c < capsules.size(); ++c) {
    if (members[c].empty()) continue;
    ProxyCapsule capsule = capsules[c];
    std::vector<Vec3d> local;
    for (std::size_t s = 0; s < poses.size(); ++s) {
      const Affine3<double> back = rigid_inverse(poses[s][capsule.joint]);
      for (const std::size_t i : members[c]) local.push_back(back * centers[s][i]);
    }
    const auto quantile = [&](std::vector<double>& v, double q) {
      const auto at = v.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(v.size() - 1));
      std::nth_element(v.begin(), at, v.end());
      return *at;
    };
    const Vec3d axis = normalized(capsule.p1 - capsule.p0), middle = (capsule.p0 + capsule.p1) * 0.5;
    if (dot(axis, axis) > 0) {
      // First across the axis, using the middle half only, where the round ends have no effect.
      std::vector<double> along, across;
      const double half = 0.5 * norm(capsule.p1 - capsule.p0);
      Vec3d offset{};
      for (const Vec3d& p : local) {
        const double t = dot(p - middle, axis);
        along.push_back(t);
        if (abs(t) < half) offset += (p - middle - axis * t) * (1.0 / static_cast<double>(local.size()));
      }
      const double low = quantile(along, 1 - percentile), high = quantile(along, percentile);
      const Vec3d center = middle + offset;
      for (const Vec3d& p : local) {
        const Vec3d d = p - center;
        across.push_back(norm(d - axis * dot(d, axis)));
      }
      const double radius = quantile(across, percentile);
      const double cap = min(radius, 0.5 * (high - low));
      capsule.p0 = center + axis * (low + cap);
      capsule.p1 = center + axis * (high - cap);
    } else {
      Vec3d sum{};
      for (const Vec3d& p : local) sum += p;
      capsule.p0 = capsule.p1 = sum * (1.0 / static_cast<double>(local.size()));
    }
    std::vector<double> distance;
    for (const Vec3d& p : local) distance.push_back(segment_distance2(capsule.p0, capsule.p1, p));
    capsule.radius = sqrt(quantile(distance, percentile));
    fitted.push_back(capsule);
  }
  capsules = std::move(fitted);
}

}  // namespace gsnav
