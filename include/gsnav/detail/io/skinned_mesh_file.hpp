// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/skinned_mesh.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/io/read_limits.hpp"

namespace gsnav::io {

/// A clip on the mesh's skeleton, with its name.
struct NamedClip {
  std::string name;  ///< Name in the file, or "clip0", "clip1", ...
  MotionClip clip;   ///< The motion.
};

/// A rigged surface and its animations.
struct LoadedSkinnedMesh {
  SkinnedMesh mesh;              ///< The rigged surface.
  LocalPose pose;                ///< The pose that the file shows without animation.
  std::vector<NamedClip> clips;  ///< Animations of the file.
  SkinnedMeshReport report;      ///< What the reader found and changed.
};

/// How a rigged glTF file is read.
struct GltfOptions {
  /// Names or indices of the skins whose meshes are read; they must share a rig. Empty: all skins.
  std::vector<std::string> skins{};
  double scale = 1.0;       ///< Metres for each unit of the file (0.01 for centimetres), > 0.
  double frame_rate = 0.0;  ///< Frames per second for clips whose keys are not evenly spaced; 0: 60.
  ReadLimits limits{};      ///< json_depth and texture_side are used.
};

/// Reads the skinned meshes of one rig, and all animations, from a glTF 2.0 file (`.glb`, or `.gltf`
/// with buffers inside or next to it). It reads positions, JOINTS_n and WEIGHTS_n (n = 0, 1, ...; sums
/// other than 1 are divided out and counted), TEXCOORD_0, COLOR_0, base colour factor and texture
/// (PNG, or JPEG in builds with libjpeg), alpha cut-off, and animations (step, linear, cubic spline) of
/// nodes. Morph targets, other textures, and meshes without a skin that is read are skipped with a
/// warning.
///
/// Skins share a rig if they share joints (nodes), in any order, and if one map takes the inverse binds
/// of all shared joints that move vertices of both from one skin to the other. For a body cut into parts
/// that map is the identity. Their meshes become one mesh on the joints of all. `report.skins` of
/// `report.skins_in_file` skins were read.
///
/// A clip begins at time 0 and ends at its last key, as in other viewers. Before the first key of a
/// channel that key holds, with a warning. Evenly spaced keys keep their rate. Other clips are sampled
/// at `frame_rate`, including translations and scales of nodes that are not joints.
///
/// The scene of a glTF file has Y up, is in metres and faces +Z. The mesh is turned upright to face -Z,
/// by multiples of 90 degrees where that suffices. Joints become rigid: a scale common to all (as in a
/// file in centimetres) is applied to positions; other scales of joints are left out, with the error in
/// `report.rigid_error`. A joint that moves no vertex gets its position in the file's pose as its bind.
/// A joint without a name is called "node<n>"; the second of two equal names gets the suffix "#<n>".
///
/// Errors name the file, the element and the value. Never throws.
/// @return the result, or one of these errors:
/// - file_not_found.
/// - invalid_file: JSON, an index out of range, data beyond its buffer, a cycle of nodes, weights that
///   are negative or all zero, or an inverse bind that is not rigid times a scale.
/// - unsupported: required extensions, no skin, skins of several rigs (with their names), primitives
///   other than triangles, or JSON nested deeper than `limits` allow.
/// - invalid_argument: an option is out of range.
/// - out_of_memory.
Result<LoadedSkinnedMesh> load_gltf_skin(const std::filesystem::path& path,
                                         const GltfOptions& options = {});

/// Clips for a skeleton, read from a separate file.
struct LoadedClips {
  std::vector<NamedClip> clips;       ///< Animations of the file.
  std::vector<std::string> warnings;  ///< Messages for people, one per problem.
};

/// Reads the animations of a glTF 2.0 file, with or without a skin, for `skeleton`. A joint corresponds
/// to the node with its name ("name#2" is the second node called "name"). The node's transform in the
/// scene is used, turned to face -Z as by load_gltf_skin, so that the clips fit a skeleton that
/// load_gltf_skin read from the same rig. Joints without a node keep their rest pose relative to their
/// parent, with a warning. `options.skins` is not used. Errors: those of load_gltf_skin;
/// invalid_argument naming the joints, if a root or more than half of all joints have no node;
/// invalid_file (no animation).
Result<LoadedClips> load_gltf_clips(const std::filesystem::path& path, const Skeleton& skeleton,
                                    const GltfOptions& options = {});

/// How MakeHuman's files are read.
struct MakeHumanOptions {
  std::filesystem::path skeleton;  ///< A `.mhskel` file.
  std::filesystem::path weights;   ///< A `.mhw` file; empty: the one that the skeleton names.
  std::vector<std::pair<std::filesystem::path, double>>
      targets;                    ///< `.target` files, and the weight of each.
  std::string group = "body";     ///< The group whose faces are the surface.
  Vec3d color{0.80, 0.62, 0.52};  ///< Colour of the surface, display-referred.
  double scale = 0.1;             ///< Metres for each unit of the file.
  ReadLimits limits{};            ///< json_depth is used, for skeleton and weights.
};

/// Reads a MakeHuman base mesh (`.obj`) with its skeleton, weights and shape targets. The body is turned
/// to face -Z, with its lowest point on y = 0. A joint lies at the mean of its bone's head vertices and
/// keeps the world's axes. Weights that do not sum to 1 are divided out; vertices without weights take
/// those of the nearest vertex that has some. Both are counted. A bone without a parent is a root.
///
/// Errors name the file, the element and the value: file_not_found; invalid_file (also for a cycle of
/// bones or a vertex that does not exist); invalid_argument; out_of_memory. Never throws.
Result<LoadedSkinnedMesh> load_makehuman(const std::filesystem::path& path,
                                         const MakeHumanOptions& options);

}  // namespace gsnav::io
