// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/avatar/asset.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/weight_truncation.hpp"
#include "gsnav/detail/scene/load_report.hpp"

namespace gsnav::io {

/// What `shs` with one coefficient a Gaussian holds; files do not say.
enum class AvatarColors : std::uint8_t {
  guess,         ///< Habitat-GS's rule: RGB where every value of the file lies in [0, 1]
  coefficients,  ///< SH coefficients
  rgb,           ///< display colours
};

/// How an avatar is read.
struct LoadAvatarOptions {
  AvatarColors colors = AvatarColors::guess;  ///< What the colours in the file are.
  /// Names and parents of the joints. Empty: the file's own `joint_names` and `joint_parents`, else SMPL
  /// for 24 joints and SMPL-X for 55.
  std::vector<std::string> joint_names;
  std::vector<std::int32_t> joint_parents;  ///< Parent of each joint, or -1 for the root.
  WeightOptions
      weights;  ///< how many are kept; its poses are where the error of dropping some is measured
};

/// A body as its file gives it.
struct LoadedAvatar {
  AvatarAsset asset;     ///< The avatar.
  LoadReport report;     ///< What the reader found, changed and left out.
  WeightReport weights;  ///< What happened to the skinning weights.
};

/// Reads a canonical Gaussian avatar, `canonical_gs.npz` with Habitat-GS's keys, any number type in C or
/// Fortran order: means [N,3] (metres), shs [N,3] or [N,K,3] (K = 1, 4, 9, 16; coefficient, then
/// colour), scales [N,3] (linear, metres), quats [N,4] (w, x, y, z, any length), opacities [N] or [N,1]
/// (0 to 1), lbs_weights [N,J] (any sum above zero), joints_inv_bind_matrix [J,4,4], [1,J,4,4] or [J,16]
/// (row-major, rigid). Positions stay in the file's frame (SMPL's faces +Z, gsnav's avatars -Z).
///
/// A joint's frame is what its inverse bind says. Files made for Habitat-GS carry the inverse of SMPL's
/// skinning matrices there, whose frames all have their origin at the rest pose's: they fit a driver's
/// `joint_mats`, but not a motion that knows only rotations.
///
/// Four or eight weights a Gaussian are kept as `options.weights` say; what that costs is in `weights`.
///
/// A file of GART's parameters is read as well (docs/avatars.md): _xyz, _rotation (w, x, y, z), _scaling
/// (scale = min_scale + sigmoid (max_scale - min_scale), 0 to 0.1 where the file does not say), _opacity
/// (logit), _features_dc [N,3], _features_rest [N,3(K-1)] (coefficient, then colour), beside lbs_weights
/// and joints_inv_bind_matrix.
///
/// gsnav's own files may add `capsules` [C,7] (both ends in the bind frame of a joint and the radius,
/// metres) and `capsule_joints` [C], and `skinning` (0 linear, 1 linear with stretch, whose gradients
/// are fitted here, 2 dual quaternions; Skinning); a driver's `proxy_capsules` become such by
/// capsules_from_track (detail/avatar/capsule_track.hpp).
///
/// Errors name the file, the array, the row and the value: file_not_found; invalid_file (an array is
/// missing or has another shape, a value is not finite, an opacity outside [0, 1], a negative scale or
/// weight, weights all zero, an inverse bind that is not rigid); unsupported (joints that are neither
/// SMPL's nor SMPL-X's and have no names, or more than 4096; SH above degree 3; a body further than 32 m
/// from its root); invalid_argument (the options); out_of_memory. Never throws.
Result<LoadedAvatar> load_avatar(const std::filesystem::path& path,
                                 const LoadAvatarOptions& options = {});

/// Writes the same arrays, float32 except for the inverse binds (float64), weights dense. Joints that
/// are not SMPL's or SMPL-X's add `joint_names` and `joint_parents`, capsules `capsules` and
/// `capsule_joints`, other than linear skinning `skinning`. SH of degree 0 that Habitat-GS's rule would
/// take for RGB is written as RGB (float64, so that it comes back the same). Errors: what
/// AvatarAsset::validate reports; file_not_found; unsupported (4 GiB or more).
Status save_avatar(const std::filesystem::path& path, const AvatarAsset& asset);

}  // namespace gsnav::io
