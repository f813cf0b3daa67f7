// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "csv.hpp"
#include "gsnav/core/status.hpp"
#include "skinning.hpp"
#include "skinning_truth.hpp"

namespace gsnav_report {

/// Adds rows of skinning modes. They have the errors of turning the shapes only and of stretching them,
/// against the derivative of the skin itself (soft weights of all joints, central differences in
/// float64). They also have the errors that float32 adds to dual quaternions and stretch, with their
/// times. `poses` are joint matrices, `name` is their name.
gsnav::Status mode_rows(const gsnav::AvatarAsset& body, const std::vector<Matrices>& poses,
                        const char* name, const SkinningOptions& options, std::vector<Row>& rows);

}  // namespace gsnav_report
