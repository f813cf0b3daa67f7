// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// How many weights of a Gaussian are kept, and by what that is judged.
struct WeightOptions {
  int influences =
      0;  ///< 4 or 8; 0: 4 where that moves no Gaussian by more than `tolerance` in `poses`, else 8
  double tolerance = 2e-4;  ///< metres
  /// [pose][J] joint to root frame, metres. None: unknown, and 0 above means 8 where any Gaussian has
  /// more than 4.
  std::vector<std::vector<Affine3<double>>> poses;
};

/// What keeping the greatest weights of each Gaussian has done to it, against all of its weights divided
/// by their sum in double.
struct WeightReport {
  int influences = kInfluences4;  ///< weights kept
  std::size_t most_weights = 0;   ///< that any Gaussian has above zero
  double dropped_mass = 0.0;      ///< greatest share of a Gaussian's weight that was dropped
  std::size_t poses = 0;          ///< in which the following are measured; 0: unknown
  double position_error = 0.0;    ///< metres, greatest, with the weights kept and rounded
  double position_error_8 = 0.0;  ///< metres, greatest, had eight been kept
  std::size_t needs_more = 0;     ///< Gaussians off by more than the tolerance with the weights kept
};

/// AvatarAsset::set_weights with a bound: `indices` and `weights` are [N][k], a joint at most once a
/// row. Keeps four or eight weights a Gaussian as `options` say and reports what that costs. Errors:
/// what set_weights reports; invalid_argument (a pose of another number of joints, the options).
Result<WeightReport> choose_weights(AvatarAsset& asset, std::size_t k,
                                    const std::vector<std::uint16_t>& indices,
                                    const std::vector<float>& weights, const WeightOptions& options);

}  // namespace gsnav
