// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/capsule.hpp"

namespace gsnav::io {

/// A motion with the skeleton that it is of.
struct LoadedMotion {
  Skeleton skeleton;                  ///< Joints and their rest pose.
  MotionClip clip;                    ///< The motion.
  std::vector<std::string> warnings;  ///< Messages for people, one per problem.
};

/// How a BVH file is read.
struct BvhOptions {
  double scale = 1.0;  ///< metres a unit of the file (0.01 for centimetres), > 0
  bool z_up = false;   ///< the file's Z is up: turned by -90 degrees about X
};

/// Reads a BVH: its joints (without end sites) with their OFFSETs as the rest pose, all rotations zero
/// there, and its frames. Channels may come in any order and number; rotations are degrees, applied in
/// the order of the channels. Positions of a joint are added to its OFFSET, unless the first frame is
/// nearer to the OFFSET than to zero: then they replace it (both habits are common). The root's way from
/// its OFFSET is the clip's root_translation.
///
/// Errors name the file, the line and the word: file_not_found; invalid_file (syntax, a number that is
/// none, fewer or more values than frames times channels, a frame time that is not positive, joints of
/// one name); invalid_argument (the options); out_of_memory. Never throws.
Result<LoadedMotion> load_bvh(const std::filesystem::path& path, const BvhOptions& options = {});

/// How an ASF/AMC pair is read.
struct AmcOptions {
  double frame_rate = 120.0;  ///< frames a second, > 0; the files do not say (CMU records at 120 or 60)
  double scale = 0.0;  ///< metres a unit; 0: the skeleton's `length` is units an inch, as in CMU's
  bool z_up = false;   ///< the files' Z is up: turned by -90 degrees about X
};

/// Reads a motion capture in Acclaim's two files: the skeleton (`.asf`) and its motion (`.amc`). A bone
/// becomes a joint of its name at the bone's near end; a bone without children adds "<name>_end" at its
/// far end. The rest pose is the skeleton's, all frames turned as the world, so that a bone's turn is C
/// M C^-1 with C from its `axis` and M from its `dof` (both: the first of the order is applied first).
/// The root's way is the clip's root_translation. `limits`, `mass` and other sections are skipped.
///
/// Errors name the file, the line and the word: file_not_found; invalid_file (syntax, a bone twice, one
/// that is in no or an unknown place of the hierarchy, a value for an unknown bone or another number of
/// values than its `dof`, a frame that lacks a bone with `dof`, no frames); unsupported (a `dof` that is
/// no rotation); invalid_argument (the options); out_of_memory. Never throws.
Result<LoadedMotion> load_amc(const std::filesystem::path& skeleton, const std::filesystem::path& motion,
                              const AmcOptions& options = {});

/// A driver: how an avatar moves, and optionally the capsules that go with it.
struct LoadedDriver {
  MotionClip clip;  ///< of the skeleton that was given
  std::vector<std::vector<Capsule<double>>>
      capsules;  ///< [T][C], the clip's frame, metres; may be empty
};

/// Reads `driver.npz`, Habitat-GS's driver as arrays: joint_mats [T,J,4,4] (joint to root frame with the
/// translation in it, rigid), joint_mats_space "smpl_with_trans", joint_mats_version 1, joint_mats_fps
/// or fps (any rate above zero; both must agree), joint_mats_joint_count, and optionally proxy_capsules
/// [T,C,7] (both ends and the radius, metres). All but joint_mats and a rate may be missing.
///
/// `skeleton` is the avatar's (load_avatar). Matrices are taken apart into local rotations and places,
/// so that sampling is by slerp in joint space. Errors name the file, the array and the value:
/// file_not_found; invalid_file; unsupported (another space or version); out_of_memory. Never throws.
Result<LoadedDriver> load_driver(const std::filesystem::path& path, const Skeleton& skeleton);

/// A driver about to be written.
struct DriverFrames {
  double frame_rate = 40.0;  ///< frames a second, > 0 (Habitat-GS plays 40 whatever is said)
  std::size_t joints = 0;    ///< J
  std::vector<Affine3<double>> matrices;  ///< [T][J] joint to the driver's frame, metres, rigid
  std::vector<std::vector<Capsule<double>>> capsules;  ///< [T][C] in the same frame, or empty
};

/// Writes `driver.npz` with Habitat-GS's keys (float32), as load_driver reads it.
/// Errors: invalid_argument naming the field; file_not_found; unsupported (4 GiB or more);
/// out_of_memory.
Status save_driver(const std::filesystem::path& path, const DriverFrames& frames);

/// How a file of SMPL poses is read.
struct SmplMotionOptions {
  bool z_up = true;  ///< the motion's Z is up, as in AMASS: turned by -90 degrees about X
};

/// Reads an AMASS or SMPL-X motion: poses [T,3J] (axis times angle in radians, J = 24, 52 or 55), trans
/// [T,3] (metres), mocap_framerate or mocap_frame_rate, optionally betas. `model` is the body model as
/// npz, which its licence makes the user's to bring: v_template [V,3], J_regressor [J,V], kintree_table
/// [2,J] and, where the motion has betas, shapedirs [V,3,S]. It has 24 joints (SMPL) or 55 (SMPL-X,
/// whose hands take SMPL-H's poses; jaw and eyes rest then). Rest joints are J_regressor (v_template +
/// shapedirs betas).
///
/// Errors name the file, the array and the value: file_not_found; invalid_file; unsupported (poses for
/// other joints than the model's); out_of_memory. Never throws.
Result<LoadedMotion> load_smpl_motion(const std::filesystem::path& path,
                                      const std::filesystem::path& model,
                                      const SmplMotionOptions& options = {});

}  // namespace gsnav::io
