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

/// A motion and its skeleton.
struct LoadedMotion {
  Skeleton skeleton;                  ///< Joints and their rest pose.
  MotionClip clip;                    ///< The motion.
  std::vector<std::string> warnings;  ///< Messages for people, one per problem.
};

/// How a BVH file is read.
struct BvhOptions {
  double scale = 1.0;  ///< Metres for each unit of the file (0.01 for centimetres), > 0.
  bool z_up = false;   ///< Whether Z is up in the file. It is then turned by -90 degrees about X.
};

/// Reads a BVH file: a skeleton and its frames. Its joints, without end sites, have their OFFSETs as the
/// rest pose, with all rotations zero. Channels may have any order and number; rotations are in degrees
/// and applied in the order of the channels. Positions of a joint are added to its OFFSET, unless the
/// first frame's position is nearer to the OFFSET than to zero: then they replace it, since both habits
/// are common. The root's movement from its OFFSET is the clip's root_translation.
///
/// Errors name the file, the line and the word: file_not_found; invalid_file (syntax, a malformed
/// number, another number of values than frames times channels, a frame time that is not positive, two
/// joints with one name); invalid_argument (the options); out_of_memory. Never throws.
Result<LoadedMotion> load_bvh(const std::filesystem::path& path, const BvhOptions& options = {});

/// How an ASF/AMC pair is read.
struct AmcOptions {
  double frame_rate = 120.0;  ///< Frames per second, > 0. The files do not say; CMU records at 120 or
                              ///< 60.
  double scale = 0.0;  ///< Metres for each unit; 0: the skeleton's `length` is in units per inch, as in
                       ///< CMU's files.
  bool z_up = false;   ///< Whether Z is up in the files. They are then turned by -90 degrees about X.
};

/// Reads a motion capture from Acclaim's two files, a skeleton (`.asf`) and its motion (`.amc`). A bone
/// becomes a joint of the same name at its near end; a bone without children adds a joint "<name>_end"
/// at its far end. The rest pose is that of the skeleton, with all joint frames parallel to the world.
/// The rotation of a bone is therefore C M C^-1, with C from its `axis` and M from its `dof`; in both,
/// the first rotation listed is applied first. The root's movement is the clip's root_translation.
/// `limits`, `mass` and other sections are skipped.
///
/// Errors name the file, the line and the word. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found.
/// - invalid_file: syntax, a bone that is defined twice or is missing from the hierarchy, a value for an
///   unknown bone, a wrong number of values, a bone without values in some frame, or no frames.
/// - unsupported: a `dof` that is not a rotation.
/// - invalid_argument: an option is out of range.
/// - out_of_memory.
Result<LoadedMotion> load_amc(const std::filesystem::path& skeleton, const std::filesystem::path& motion,
                              const AmcOptions& options = {});

/// A driver: the motion of an avatar, and optionally its capsules.
struct LoadedDriver {
  MotionClip clip;  ///< On the skeleton that was given.
  std::vector<std::vector<Capsule<double>>>
      capsules;  ///< [T][C] in the clip's frame, metres; may be empty.
};

/// Reads `driver.npz`, Habitat-GS's driver as arrays:
///
/// - joint_mats [T,J,4,4]: joint to root frame including the translation, rigid.
/// - joint_mats_fps or fps: any rate above zero. If both are present, they must agree.
/// - joint_mats_space: "smpl_with_trans" (optional).
/// - joint_mats_version: 1 (optional).
/// - joint_mats_joint_count: J (optional).
/// - proxy_capsules [T,C,7]: both ends and the radius, metres (optional).
///
/// `skeleton` is the avatar's (load_avatar). Matrices are split into local rotations and translations,
/// so that frames are interpolated by slerp in joint space. Errors name the file, the array and the
/// value: file_not_found; invalid_file; unsupported (another space or version); out_of_memory. Never
/// throws.
Result<LoadedDriver> load_driver(const std::filesystem::path& path, const Skeleton& skeleton);

/// A driver to be written.
struct DriverFrames {
  double frame_rate = 40.0;  ///< Frames per second, > 0. (Habitat-GS plays 40 whatever the file says.)
  std::size_t joints = 0;    ///< J, the number of joints.
  std::vector<Affine3<double>> matrices;  ///< [T][J] joint to the driver's frame, metres, rigid.
  std::vector<std::vector<Capsule<double>>> capsules;  ///< [T][C] in the same frame, or empty.
};

/// Writes `driver.npz` with Habitat-GS's keys in float32, as load_driver reads it. Errors:
/// invalid_argument naming the field; file_not_found; unsupported (4 GiB or more); out_of_memory.
Status save_driver(const std::filesystem::path& path, const DriverFrames& frames);

/// How a file of SMPL poses is read.
struct SmplMotionOptions {
  bool z_up = true;  ///< Whether Z is up in the motion, as in AMASS. It is then turned by -90 degrees
                     ///< about X.
};

/// Reads an AMASS or SMPL-X motion: poses [T,3J] (axis times angle in radians; J = 24, 52 or 55), trans
/// [T,3] (metres), mocap_framerate or mocap_frame_rate, and optionally betas.
///
/// `model` is the body model as npz, which its licence requires users to get themselves. It has
/// v_template [V,3], J_regressor [J,V], kintree_table [2,J] and, if the motion has betas, shapedirs
/// [V,3,S], with 24 joints (SMPL) or 55 (SMPL-X). A motion with 52 joints (SMPL-H) moves body and hands
/// of an SMPL-X model; jaw and eyes then rest. Rest joints are J_regressor (v_template + shapedirs
/// betas).
///
/// Errors name the file, the array and the value: file_not_found; invalid_file; unsupported (poses for
/// joints that the model does not have); out_of_memory. Never throws.
Result<LoadedMotion> load_smpl_motion(const std::filesystem::path& path,
                                      const std::filesystem::path& model,
                                      const SmplMotionOptions& options = {});

}  // namespace gsnav::io
