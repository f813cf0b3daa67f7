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

/// Meaning of the values in `shs` when it has one coefficient for each Gaussian. Files do not say.
enum class AvatarColors : std::uint8_t {
  guess,         ///< Habitat-GS's rule: RGB if every value in the file lies in [0, 1].
  coefficients,  ///< SH coefficients.
  rgb,           ///< Display colours.
};

/// Options of load_avatar.
struct LoadAvatarOptions {
  /// Meaning of `shs` with one coefficient for each Gaussian.
  AvatarColors colors = AvatarColors::guess;
  /// Names and parents of the joints. Empty: `joint_names` and `joint_parents` of the file, or else SMPL
  /// for 24 joints and SMPL-X for 55.
  std::vector<std::string> joint_names;
  std::vector<std::int32_t> joint_parents;  ///< Parent of each joint, or -1 for the root.
  WeightOptions weights;  ///< How many weights are kept, and the poses in which the error of dropping
                          ///< the others is measured.
};

/// A body that load_avatar read.
struct LoadedAvatar {
  AvatarAsset asset;     ///< The body.
  LoadReport report;     ///< What reading found, changed and left out.
  WeightReport weights;  ///< The error of the weights that were dropped.
};

/// Reads a canonical Gaussian avatar: `canonical_gs.npz` with Habitat-GS's keys. Arrays may have any
/// number type, in C or Fortran order:
///
/// - means [N,3]: metres.
/// - shs [N,3] or [N,K,3]: K = 1, 4, 9 or 16; coefficient, then colour.
/// - scales [N,3]: linear, metres.
/// - quats [N,4]: w, x, y, z, of any length.
/// - opacities [N] or [N,1]: 0 to 1.
/// - lbs_weights [N,J]: any sum above zero.
/// - joints_inv_bind_matrix [J,4,4], [1,J,4,4] or [J,16]: row-major, rigid.
///
/// Positions stay in the file's frame; SMPL's faces +Z, gsnav's avatars face -Z.
///
/// The frame of a joint follows from its inverse bind. Files made for Habitat-GS store the inverse of
/// SMPL's skinning matrices there, so that the origin of every frame is that of the rest pose. Such
/// files fit the `joint_mats` of a driver, but not a motion that knows only rotations.
///
/// Four or eight weights are kept for each Gaussian (`options.weights`). `LoadedAvatar::weights` reports
/// the error of that.
///
/// A file with GART's parameters is read too (docs/concepts/avatar.md): _xyz, _rotation (w, x, y, z),
/// _scaling, _opacity (logit), _features_dc [N,3], _features_rest [N,3(K-1)] (coefficient, then colour),
/// with lbs_weights and joints_inv_bind_matrix. A scale is min_scale + sigmoid (max_scale - min_scale),
/// with limits 0 and 0.1 if the file has none.
///
/// gsnav's own files may add `capsules` [C,7] (both ends in the bind frame of a joint, and the radius,
/// metres), `capsule_joints` [C], and `skinning` (Skinning: 0 linear, 1 linear with stretch, whose
/// gradients are fitted on reading, 2 dual quaternions). capsules_from_track makes capsules from the
/// `proxy_capsules` of a driver (detail/avatar/capsule_track.hpp).
///
/// Errors name the file, the array, the row and the value. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found.
/// - invalid_file: an array is missing or has another shape, a value is not finite, an opacity is
///   outside [0, 1], a scale or weight is negative, the weights of a row are all zero, or an inverse
///   bind is not rigid.
/// - unsupported: joints without names whose number is neither 24 (SMPL) nor 55 (SMPL-X), more than 4096
///   joints, SH above degree 3, or a body that reaches further than 32 m from its root.
/// - invalid_argument: an option is out of range.
/// - out_of_memory.
Result<LoadedAvatar> load_avatar(const std::filesystem::path& path,
                                 const LoadAvatarOptions& options = {});

/// Writes an avatar with the keys that load_avatar reads: float32 arrays, float64 inverse binds, dense
/// weights. `joint_names` and `joint_parents` are added for other skeletons than SMPL and SMPL-X,
/// `capsules` and `capsule_joints` where there are capsules, and `skinning` where it is not linear. SH
/// of degree 0 that Habitat-GS's rule would take for RGB is written as RGB (in float64, so that the same
/// values are read back). Errors: those of AvatarAsset::validate; file_not_found; unsupported (4 GiB or
/// more).
Status save_avatar(const std::filesystem::path& path, const AvatarAsset& asset);

}  // namespace gsnav::io
