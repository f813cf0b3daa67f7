// SPDX-License-Identifier: Apache-2.0
#include "skinning_truth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runner_timing.hpp"

namespace gsnav_report {

using namespace gsnav;

SoftWeights::SoftWeights(const AvatarAsset& asset)
    : asset_(&asset), rest_(asset.skeleton.rest_globals()) {}

void SoftWeights::at(const Vec3d& p, std::vector<double>& out) const {
  constexpr double kSoftness = 0.025;
  out.assign(rest_.size(), std::numeric_limits<double>::infinity());  // distances at first
  for (const ProxyCapsule& c : asset_->capsules) {
    const Vec3d a = rest_[c.joint] * c.p0, d = rest_[c.joint] * c.p1 - a;
    const double s = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-12), 0.0, 1.0);
    out[c.joint] = std::min(out[c.joint], std::max(norm(p - a - d * s) - c.radius, 0.0));
  }
  const double nearest = *std::min_element(out.begin(), out.end());
  double sum = 0;
  for (double& w : out) sum += w = std::exp((nearest - w) / kSoftness);
  for (double& w : out) w /= sum;
}

std::vector<Matrices> skinning_matrices(const Skeleton& skeleton, const std::vector<LocalPose>& poses) {
  const Matrices inverse = skeleton.bind_inverses();
  std::vector<Matrices> out;
  for (const LocalPose& pose : poses) {
    forward_kinematics(skeleton, pose, out.emplace_back());
    for (std::size_t j = 0; j < inverse.size(); ++j) out.back()[j] = out.back()[j] * inverse[j];
  }
  return out;
}

double angle_degrees(const Mat3d& a, const Mat3d& b) {
  const Mat3d d = transpose(a) * b;
  const Vec3d axis{d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1)};
  return std::atan2(norm(axis), d(0, 0) + d(1, 1) + d(2, 2) - 1) * 57.29577951308232;
}

void add_error_row(std::vector<Row>& rows, Row row, const char* name, const char* unit,
                   std::vector<double>& values) {
  const double p99 = percentile(values, 0.99);
  row.set("name", name)
      .set("error_max", percentile(values, 1.0))
      .set("error_p99", p99)
      .set("error_unit", unit);
  rows.push_back(std::move(row));
}

void add_skinning_rows(std::vector<Row>& rows, const Row& base, SkinningErrors& e) {
  add_error_row(rows, base, "position", "m", e.position);
  add_error_row(rows, base, "rotation", "deg", e.rotation);
}

}  // namespace gsnav_report
