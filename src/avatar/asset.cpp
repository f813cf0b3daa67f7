// SPDX-License-Identifier: Apache-2.0
#include "gsnav/avatar/asset.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gsnav {

Result<double> AvatarAsset::set_weights(std::size_t k, const std::vector<std::uint16_t>& indices,
                                        const std::vector<float>& weights, int keep) {
  const std::size_t n = size();
  if (keep != kInfluences4 && keep != kInfluences8) {
    return {Errc::invalid_argument,
            "AvatarAsset: " + std::to_string(keep) + " influences; 4 or 8 are supported"};
  }
  if (k == 0 || indices.size() != n * k || weights.size() != n * k) {
    return {Errc::invalid_argument, "AvatarAsset: " + std::to_string(weights.size()) + " weights and " +
                                        std::to_string(indices.size()) + " joint indices for " +
                                        std::to_string(n) + " Gaussians of " + std::to_string(k)};
  }
  const std::size_t row = static_cast<std::size_t>(keep), used = min(k, row);
  std::vector<std::uint16_t> joint_out(n * row, 0), weight_out(n * row, 0);
  std::vector<std::size_t> order(k);
  std::vector<double> sorted(used);
  double dropped = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto bad = [&](const std::string& what) {
      return Status(Errc::invalid_argument, "AvatarAsset: Gaussian " + std::to_string(i) + " " + what);
    };
    double all = 0.0, kept = 0.0;
    for (std::size_t j = 0; j < k; ++j) {
      const float w = weights[i * k + j];
      if (!(w >= 0) || !is_finite(w)) return bad("has weight " + std::to_string(w));
      if (indices[i * k + j] >= skeleton.size()) {
        return bad("names joint " + std::to_string(indices[i * k + j]) + " of " +
                   std::to_string(skeleton.size()));
      }
      all += static_cast<double>(w);
      order[j] = j;
    }
    if (!(all > 0)) return bad("has no weight");
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return weights[i * k + a] > weights[i * k + b];
    });
    for (std::size_t j = 0; j < row; ++j) {
      joint_out[i * row + j] = indices[i * k + order[j < used ? j : 0]];
      if (j < used) kept += sorted[j] = static_cast<double>(weights[i * k + order[j]]);
    }
    dropped = max(dropped, 1.0 - kept / all);
    round_weights(sorted.data(), used, weight_out.data() + i * row);
  }
  influences = keep;
  weight_gradients.clear();
  joint_indices = std::move(joint_out);
  skinning_weights = std::move(weight_out);
  return dropped;
}

Status AvatarAsset::validate() const {
  const auto bad = [&](const std::string& what) {
    return Status(Errc::invalid_argument,
                  "AvatarAsset" + (name.empty() ? "" : " \"" + name + "\"") + ": " + what);
  };
  if (Status s = skeleton.validate(); !s) return s;
  const std::size_t n = size(), joints = skeleton.size();
  if (joints > 65535) return bad("more than 65535 joints");
  if (!cloud.origins.empty()) {
    return {Errc::unsupported, "AvatarAsset: a canonical Gaussian lies more than 32 m from the root"};
  }
  if (cloud.compact()) return bad("the cloud is compact: expand_sh first");
  if (influences != kInfluences4 && influences != kInfluences8) {
    return bad("influences is " + std::to_string(influences) + "; 4 or 8 are supported");
  }
  const std::size_t row = static_cast<std::size_t>(influences);
  if (joint_indices.size() != n * row || skinning_weights.size() != n * row) {
    return bad("joint_indices and skinning_weights need " + std::to_string(row) +
               " values per Gaussian (set_weights makes them)");
  }
  for (std::size_t i = 0; i < n; ++i) {
    int sum = 0;
    for (std::size_t k = i * row; k < (i + 1) * row; ++k) {
      if (joint_indices[k] >= joints) {
        return bad("Gaussian " + std::to_string(i) + " names joint " + std::to_string(joint_indices[k]) +
                   " of " + std::to_string(joints));
      }
      if (skinning_weights[k] > skinning_weights[i * row]) {
        return bad("Gaussian " + std::to_string(i) + " does not have its greatest weight first");
      }
      sum += skinning_weights[k];
    }
    if (sum != kWeightParts) {
      return bad("weights of Gaussian " + std::to_string(i) + " sum to " + std::to_string(sum) +
                 " parts of " + std::to_string(kWeightParts));
    }
  }
  if (skinning == Skinning::linear_stretched) {
    if (weight_gradients.size() != 3 * n * (row - 1)) {
      return bad("weight_gradients has " + std::to_string(weight_gradients.size()) + " values where " +
                 std::to_string(3 * n * (row - 1)) + " are needed (bake_weight_gradients makes them)");
    }
    for (std::size_t k = 0; k < weight_gradients.size(); ++k) {
      if (!is_finite(weight_gradients[k])) {
        return bad("weight_gradients of Gaussian " + std::to_string(k / (3 * (row - 1))) +
                   " are not finite");
      }
    }
  }
  for (std::size_t c = 0; c < capsules.size(); ++c) {
    const ProxyCapsule& p = capsules[c];
    if (p.joint >= joints || !(p.radius >= 0) || !is_finite(p.radius) || !is_finite(p.p0) ||
        !is_finite(p.p1)) {
      return bad("capsule " + std::to_string(c) + " names no joint or is not finite");
    }
  }
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const AvatarLevel& level = levels[l];
    const std::string at = "levels[" + std::to_string(l) + "]";
    if (level.body == nullptr || level.body->skeleton.size() != joints || !level.body->levels.empty()) {
      return bad(at + ".body is null, has levels, or has another skeleton");
    }
    if (level.body->skinning != skinning) return bad(at + ".body has another kind of skinning");
    if (!(level.error >= (l == 0 ? 0 : levels[l - 1].error)) || !is_finite(level.error) ||
        !(level.grain >= 0) || !is_finite(level.grain)) {
      return bad(at + ": its error is less than that of the level before, or it is not finite");
    }
    if (Status s = level.body->validate(); !s) return bad(at + ".body: " + s.message());
  }
  if (levels.size() > kMostLevels) return bad("more than " + std::to_string(kMostLevels) + " levels");
  if (!idle.rotations.empty() &&
      (idle.rotations.size() != joints || idle.translations.size() != joints)) {
    return bad("idle has another number of joints than the skeleton");
  }
  if (!idle.rotations.empty()) {
    if (Status s = idle.validate("idle"); !s) return bad(s.message());
  }
  return {};
}

}  // namespace gsnav
