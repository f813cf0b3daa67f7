// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/io/avatar_file.hpp"

namespace gsnav::io::detail {

/// Fills the position errors of `report`: how far the asset's Gaussians are from where all weights put
/// them, in every pose of the options. `weights` [rows][J] are the file's, `rows[i]` is the file's row
/// of Gaussian i. Errors: invalid_argument (a pose of another number of joints).
Status measure_truncation(const AvatarAsset& asset, const std::vector<double>& weights,
                          const std::vector<std::size_t>& rows, const LoadAvatarOptions& options,
                          WeightReport& report);

}  // namespace gsnav::io::detail
