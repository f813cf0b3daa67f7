// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/kernels/lbs.hpp"

namespace gsnav::detail {

/// Skeleton with SMPL-X's 55 joint names and order, arms out sideways, facing -Z, feet on y = 0.
inline Skeleton smplx_skeleton(double height) {
  Skeleton s;
  const double k = height / 1.70;
  const auto add = [&](std::string name, int parent, Vec3d p) {
    s.names.push_back(std::move(name));
    s.parents.push_back(parent);
    s.rest_positions.push_back(p * k);
  };
  add("pelvis", -1, {0, 0.95, 0});
  add("left_hip", 0, {-0.09, 0.89, 0});
  add("right_hip", 0, {0.09, 0.89, 0});
  add("spine1", 0, {0, 1.05, 0});
  add("left_knee", 1, {-0.10, 0.50, 0});
  add("right_knee", 2, {0.10, 0.50, 0});
  add("spine2", 3, {0, 1.17, 0});
  add("left_ankle", 4, {-0.10, 0.08, 0.02});
  add("right_ankle", 5, {0.10, 0.08, 0.02});
  add("spine3", 6, {0, 1.23, 0});
  add("left_foot", 7, {-0.10, 0.03, -0.08});
  add("right_foot", 8, {0.10, 0.03, -0.08});
  add("neck", 9, {0, 1.43, 0});
  add("left_collar", 9, {-0.05, 1.37, 0});
  add("right_collar", 9, {0.05, 1.37, 0});
  add("head", 12, {0, 1.52, -0.01});
  add("left_shoulder", 13, {-0.17, 1.38, 0});
  add("right_shoulder", 14, {0.17, 1.38, 0});
  add("left_elbow", 16, {-0.44, 1.38, 0});
  add("right_elbow", 17, {0.44, 1.38, 0});
  add("left_wrist", 18, {-0.69, 1.38, 0});
  add("right_wrist", 19, {0.69, 1.38, 0});
  add("jaw", 15, {0, 1.53, -0.03});
  add("left_eye_smplhf", 15, {-0.03, 1.60, -0.08});
  add("right_eye_smplhf", 15, {0.03, 1.60, -0.08});
  const std::array<const char*, 5> fingers{"index", "middle", "pinky", "ring", "thumb"};
  const std::array<double, 5> spread{-0.025, -0.008, 0.028, 0.010, -0.04};
  for (const int side : {-1, 1}) {
    for (std::size_t f = 0; f < 5; ++f) {
      for (int bone = 1; bone <= 3; ++bone) {
        const int parent = bone == 1 ? (side < 0 ? 20 : 21) : static_cast<int>(s.parents.size()) - 1;
        const double reach = f == 4 ? 0.72 + 0.02 * bone : 0.76 + 0.028 * bone;
        add(std::string(side < 0 ? "left_" : "right_") + fingers[f] + std::to_string(bone), parent,
            {side * reach, 1.38, spread[f]});
      }
    }
  }
  return s;
}

/// Weights by distance to the bones: a point follows the bones near it, at most four, and a bone far from
/// the nearest one not at all.
inline void bind_skin(const Skeleton& s, const std::vector<Vec3d>& points, std::vector<std::uint16_t>& indices,
                      std::vector<float>& weights) {
  // The bone of joint j runs from j to the middle of its children (or a little on).
  const std::size_t n = 22;  // fingers, jaw and eyes follow hand and head
  std::vector<std::pair<Vec3d, Vec3d>> bones(n);
  for (std::size_t j = 0; j < n; ++j) {
    Vec3d end{};
    int children = 0;
    for (std::size_t c = j + 1; c < n; ++c) {
      if (s.parents[c] == static_cast<int>(j)) {
        end += s.rest_positions[c];
        ++children;
      }
    }
    const Vec3d from = s.rest_positions[j];
    Vec3d to = children > 0 ? end * (1.0 / children) : from;
    if (children == 0 && s.parents[j] >= 0) {
      const Vec3d along = from - s.rest_positions[static_cast<std::size_t>(s.parents[j])];
      to = from + along * 0.5;
    }
    bones[j] = {from, to};
  }
  indices.assign(kInfluences * points.size(), 0);
  weights.assign(kInfluences * points.size(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<std::pair<double, std::uint16_t>> near;
    for (std::size_t j = 0; j < n; ++j) {
      const Vec3d ab = bones[j].second - bones[j].first;
      const double t = std::clamp(dot(points[i] - bones[j].first, ab) / std::max(dot(ab, ab), 1e-12), 0.0, 1.0);
      near.emplace_back(norm(points[i] - (bones[j].first + ab * t)), static_cast<std::uint16_t>(j));
    }
    std::sort(near.begin(), near.end());
    double sum = 0;
    std::array<double, kInfluences> w{};
    for (std::size_t k = 0; k < kInfluences; ++k) {
      w[k] = std::exp(-(near[k].first - near[0].first) / 0.02);
      sum += w[k];
    }
    for (std::size_t k = 0; k < kInfluences; ++k) {
      indices[kInfluences * i + k] = near[k].second;
      weights[kInfluences * i + k] = static_cast<float>(w[k] / sum);
    }
  }
}

}  // namespace gsnav::detail
