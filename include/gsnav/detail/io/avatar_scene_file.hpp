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

/// One avatar of a scene, as the file says. Paths are as they are to be opened.
struct SceneAvatar {
  std::string name;                 ///< Name of the avatar.
  std::filesystem::path canonical;  ///< `canonical_gaussians`
  std::filesystem::path driver;     ///< `.npz`; a `.pkl` in the file stands for the `.npz` beside it
  std::filesystem::path
      trajectory;      ///< or empty: [T,7] place and quaternion (x, y, z, w) before all joint matrices
  double scale = 1.0;  ///< about the floor below the root joint
  double offset_y = 0.0;           ///< metres upwards
  double time_begin = 0.0;         ///< seconds on the scene's clock
  std::optional<double> time_end;  ///< none: when the driver's frames are over
  Affine3<double> coordinates{};   ///< from the driver's frame to the world, rigid
  bool guess_coordinates =
      true;  ///< the file does not say: a root that stands on its head in the first frame is turned
};

/// The avatars of a scene and its clock.
struct AvatarScene {
  std::vector<SceneAvatar> avatars;  ///< Avatars in the order of the file.
  double time_max = 0.0;             ///< 0: when the last avatar has left
  bool time_loop = true;             ///< The clock starts again after `time_max`.
  /// Seconds by which a clock that loops goes on after `time_max` for those who are there at its end and
  /// at its begin to get back, at least; more where they would move faster than 1.4 m/s. 0: they jump,
  /// as with Habitat-GS.
  double loop_blend = 0.5;
  std::vector<std::string> warnings;  ///< keys that change nothing here
};

/// Reads `gaussian_avatars` (or `avatars`), `time_max` and `time_loop` of Habitat-GS's
/// `*.scene_instance.json`; relative paths start at the file's folder. Of an avatar: name,
/// canonical_gaussians, driver (a path, or an object of smpl_params and trajectory), scale, offset_y,
/// time_begin, time_end, coord_system (opencv, smpl_opencv, gaussian_avatar: Y down, Z forward; habitat,
/// world, none: the world's) and coord_transform (4x4 row-major, rigid). smpl_model_path, smpl_type,
/// smpl_gender, use_smpl_trans, frame_time, fps, sync_cuda and trajectory_in_smpl change nothing here.
///
/// Errors name the file, the avatar and the key: file_not_found; invalid_file; unsupported (proxy_urdf);
/// out_of_memory. A file without avatars gives none. Never throws.
Result<AvatarScene> load_avatar_scene(const std::filesystem::path& path);

/// Loads what a scene names, one actor an entry and in its order; entries with the same canonical file
/// share their body. Frames play at the driver's own rate, by slerp in joint space; where the window is
/// longer the last pose is held. Where the scene's clock loops, actors repeat with it
/// (ActorOptions::loop_period). Capsules are those of the canonical file, else the driver's. Errors:
/// what the loaders report, with the avatar's name.
Result<std::vector<AvatarActor>> load_scene_actors(const AvatarScene& scene);

/// The scene's clock at `seconds` since the start: within [0, time_max + what blending takes) where it
/// loops, else held at time_max. `actors` are the scene's, for a file without a time_max.
double scene_time(const AvatarScene& scene, const std::vector<AvatarActor>& actors,
                  double seconds) noexcept;

}  // namespace gsnav::io
