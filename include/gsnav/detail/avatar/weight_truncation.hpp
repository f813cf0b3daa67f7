// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"

namespace gsnav {

/// Number of weights that are kept for each Gaussian, and how it is chosen.
struct WeightOptions {
  int influences = 0;  ///< 4, 8, or 0: 4 if that moves no Gaussian by more than `tolerance` in any of
                       ///< `poses`, else 8.
  double tolerance = 2e-4;  ///< Metres.
  /// [pose][J] joint to root frame, metres. Without poses, `influences` = 0 means 8 if any Gaussian has
  /// more than 4 weights.
  std::vector<std::vector<Affine3<double>>> poses;
};

/// The error of keeping only the greatest weights of each Gaussian, compared with all of its weights
/// divided by their sum in double.
struct WeightReport {
  int influences = kInfluences4;  ///< Weights kept.
  std::size_t most_weights = 0;   ///< Largest number of positive weights of any Gaussian.
  double dropped_mass = 0.0;      ///< Greatest share of a Gaussian's weight that was dropped.
  std::size_t poses = 0;          ///< Number of poses in which the following are measured; 0: they are
                                  ///< unknown.
  double position_error = 0.0;    ///< Greatest error of a position with the weights kept and rounded,
                                  ///< metres.
  double position_error_8 = 0.0;  ///< Greatest error of a position if eight were kept, metres.
  std::size_t needs_more = 0;     ///< Gaussians whose error with the kept weights exceeds the tolerance.
};

/// Sets the weights of an asset and bounds the error: AvatarAsset::set_weights with the number of
/// weights chosen by `options`. `indices` and `weights` are [N][k], each joint at most once in a row.
/// Errors: those of set_weights; invalid_argument (a pose with another number of joints, an option out
/// of range).
Result<WeightReport> choose_weights(AvatarAsset& asset, std::size_t k,
                                    const std::vector<std::uint16_t>& indices,
                                    const std::vector<float>& weights, const WeightOptions& options);

}  // namespace gsnav
