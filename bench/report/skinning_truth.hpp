// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"
#include "gsnav/avatar/asset.hpp"

namespace gsnav_report {

using Matrices = std::vector<gsnav::Affine3<double>>;

/// Weights of all joints at any point. They fall off exponentially with the distance from the joint's
/// capsules beyond that of the nearest capsule, by a factor of e every 25 mm.
class SoftWeights {
 public:
  explicit SoftWeights(const gsnav::AvatarAsset& asset);
  void at(const gsnav::Vec3d& place, std::vector<double>& out) const;  ///< [J], their sum is 1

 private:
  const gsnav::AvatarAsset* asset_;
  Matrices rest_;
};

/// Skinning matrices for each pose: posed joint * inverse bind.
std::vector<Matrices> skinning_matrices(const gsnav::Skeleton& skeleton,
                                        const std::vector<gsnav::LocalPose>& poses);

/// Angle between two rotations, degrees; accurate near 0.
double angle_degrees(const gsnav::Mat3d& a, const gsnav::Mat3d& b);

struct SkinningErrors {
  std::vector<double> position, rotation;
};

/// Adds rows with the greatest and the 99th percentile of both errors.
void add_skinning_rows(std::vector<Row>& rows, const Row& base, SkinningErrors& e);
/// Adds a row for one quantity.
void add_error_row(std::vector<Row>& rows, Row row, const char* name, const char* unit,
                   std::vector<double>& values);

}  // namespace gsnav_report
