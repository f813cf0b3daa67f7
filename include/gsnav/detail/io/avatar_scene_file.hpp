// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/mat.hpp"

namespace gsnav::io {

/// One avatar of a scene file. Paths are resolved: they can be opened as they are.
struct SceneAvatar {
  std::string name;                 ///< Name of the avatar.
  std::filesystem::path canonical;  ///< The file of `canonical_gaussians`.
  std::filesystem::path driver;     ///< A `.npz`. For a `.pkl` in the scene file, the `.npz` next to it.
  std::filesystem::path trajectory;  ///< [T,7] position and quaternion (x, y, z, w), applied before all
                                     ///< joint matrices; or empty.
  double scale = 1.0;                ///< Scale about the floor below the root joint.
  double offset_y = 0.0;             ///< Metres upwards.
  double time_begin = 0.0;           ///< Seconds on the scene's clock.
  std::optional<double> time_end;    ///< Empty: the avatar leaves after the driver's last frame.
  Affine3<double> coordinates{};     ///< Rigid map from the driver's frame to the world.
  bool guess_coordinates = true;  ///< Whether the scene file names no coordinate system. An avatar whose
                                  ///< root is upside down in the first frame is then turned over.
};

/// The avatars of a scene, and its clock.
struct AvatarScene {
  std::vector<SceneAvatar> avatars;  ///< The avatars, in the order of the file.
  double time_max = 0.0;  ///< Length of the clock's period, seconds. 0: until the last avatar has left.
  bool time_loop = true;  ///< Whether the clock loops.
  /// Least duration of the blend that a looping clock adds after `time_max`, seconds. During the blend,
  /// avatars that are present at both ends of the period move from where they stop to where they start.
  /// It lasts longer if an avatar would move faster than 1.4 m/s. 0: avatars jump, as in Habitat-GS.
  double loop_blend = 0.5;
  std::vector<std::string> warnings;  ///< Keys that have no effect here.
};

/// Reads the avatars of Habitat-GS's `*.scene_instance.json`: `gaussian_avatars` (or `avatars`),
/// `time_max` and `time_loop`. Relative paths start at the file's folder. An avatar has the keys name,
/// canonical_gaussians, driver (a path, or an object with smpl_params and trajectory), scale, offset_y,
/// time_begin, time_end, coord_system (opencv, smpl_opencv and gaussian_avatar have Y down and Z
/// forward; habitat, world and none have the world's axes) and coord_transform (4x4 row-major, rigid).
/// These have no effect: smpl_model_path, smpl_type, smpl_gender, use_smpl_trans, frame_time, fps,
/// sync_cuda, trajectory_in_smpl.
///
/// A file without avatars gives an empty list. Never throws. Errors name the file, the avatar and the
/// key: file_not_found; invalid_file; unsupported (proxy_urdf); out_of_memory.
Result<AvatarScene> load_avatar_scene(const std::filesystem::path& path);

/// Loads the files of a scene's avatars and makes one actor for each, in order. Entries with the same
/// canonical file share their body. Frames play at the driver's own rate, interpolated by slerp in joint
/// space; after the last frame the last pose is held. If the scene's clock loops, actors repeat with it
/// (ActorOptions::loop_period). Capsules are those of the canonical file, or else of the driver. Errors:
/// those of the loaders, with the avatar's name.
Result<std::vector<AvatarActor>> load_scene_actors(const AvatarScene& scene);

}  // namespace gsnav::io
