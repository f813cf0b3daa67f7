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

/// A clip of a file, on the mesh's skeleton.
struct NamedClip {
  std::string name;  ///< the file's, or "clip0", "clip1", ...
  MotionClip clip;   ///< The motion.
};

/// A rigged surface with what its file can make it do.
struct LoadedSkinnedMesh {
  SkinnedMesh mesh;              ///< The rigged surface.
  LocalPose pose;                ///< how the file shows it where nothing moves
  std::vector<NamedClip> clips;  ///< Animations of the file.
  SkinnedMeshReport report;      ///< What the reader found and changed.
};

/// How a rigged glTF file is read.
struct GltfOptions {
  /// Names or indices of the skins whose meshes are read; they must share a rig. Empty: all.
  std::vector<std::string> skins{};
  double scale = 1.0;       ///< metres a unit of the file (0.01 for centimetres), > 0
  double frame_rate = 0.0;  ///< keys a second of clips whose keys are not at equal times; 0: 60
  ReadLimits limits{};      ///< json_depth and texture_side
};

/// Reads the meshes of a rig of a glTF 2.0 file (`.gltf` with buffers in it or beside it, or `.glb`):
/// positions, JOINTS_n and WEIGHTS_n (n = 0 and on; sums other than 1 are divided out and counted),
/// TEXCOORD_0, COLOR_0, base colour factor and texture (PNG, or JPEG where the build has libjpeg), alpha
/// cut-off; and all its animations (step, linear, cubic spline) of nodes. Morph targets, other textures
/// and meshes that no read skin moves are passed over with a warning.
///
/// Skins share a rig where they share joints (nodes), in any order, and one map takes the inverse binds
/// of all shared joints that move vertices of both from one skin to the other: the identity for a body
/// cut into parts. Their meshes become one, on the joints of all. `report.skins` of
/// `report.skins_in_file` were read.
///
/// A clip begins at time 0 and ends at its last key, as in other viewers: until a channel's first key,
/// that key holds, and a warning says so.
///
/// glTF's scene has Y up, metres, and faces +Z; the mesh is turned upright, in steps of 90 degrees where
/// that does it, to face -Z. Joints become rigid: a scale common to all (a file in centimetres, say)
/// goes into the positions; other scales of joints are left out, and `report.rigid_error` says what that
/// costs. A joint that moves no vertex gets the place that the file shows it in as its bind. A joint
/// without a name is called "node<n>"; of two with one name the second gets "#<n>" behind it. Keys at
/// equal times keep their rate; others are sampled at `frame_rate`, translations and scales of nodes
/// that are no joints included.
///
/// Errors name the file, the element and the value: file_not_found; invalid_file (JSON, an index out of
/// range, data behind its buffer, a node cycle, weights that are negative or all zero, an inverse bind
/// that is not rigid times a scale); unsupported (required extensions, no skin, skins of several rigs,
/// which it names, primitives other than triangles, JSON nested deeper than `limits` allow);
/// invalid_argument (the options); out_of_memory. Never throws.
Result<LoadedSkinnedMesh> load_gltf_skin(const std::filesystem::path& path,
                                         const GltfOptions& options = {});

/// Clips for a skeleton, read from a file of their own.
struct LoadedClips {
  std::vector<NamedClip> clips;       ///< Animations of the file.
  std::vector<std::string> warnings;  ///< Messages for people, one per problem.
};

/// Reads the animations of a glTF 2.0 file, with or without a skin, for `skeleton`. A joint is the node
/// of its name ("name#2": the second node called "name"); its place in the scene is taken, turned to
/// face -Z as by load_gltf_skin, so the clips fit skeletons that load_gltf_skin read of the same rig.
/// Joints without a node keep their rest pose on their parent, with a warning. Of the options, `skins`
/// is not used. Errors: as of load_gltf_skin; invalid_argument naming joints (a root, or more than half
/// of them, has no node); invalid_file (no animation).
Result<LoadedClips> load_gltf_clips(const std::filesystem::path& path, const Skeleton& skeleton,
                                    const GltfOptions& options = {});

/// How MakeHuman's files are read.
struct MakeHumanOptions {
  std::filesystem::path skeleton;  ///< `.mhskel`
  std::filesystem::path weights;   ///< `.mhw`; empty: the one that the skeleton names
  std::vector<std::pair<std::filesystem::path, double>>
      targets;                    ///< `.target` files and how far to go to each
  std::string group = "body";     ///< faces of this group are the surface
  Vec3d color{0.80, 0.62, 0.52};  ///< of the surface, display-referred
  double scale = 0.1;             ///< metres a unit of the file
  ReadLimits limits{};            ///< json_depth, of skeleton and weights
};

/// Reads a MakeHuman base mesh (`.obj`) with its skeleton, weights and shape targets. The body is turned
/// to face -Z and put with its lowest point on y = 0. A joint lies where the mean of its bone's head
/// vertices lies and keeps the world's axes. Weights that do not sum to 1 are divided out, vertices
/// without any take those of the nearest vertex that has some; both are counted. A bone without parent
/// is the root; others hang on it.
///
/// Errors name the file, the element and the value: file_not_found; invalid_file (also: a cycle of
/// bones, a vertex that is not there); invalid_argument; out_of_memory. Never throws.
Result<LoadedSkinnedMesh> load_makehuman(const std::filesystem::path& path,
                                         const MakeHumanOptions& options);

}  // namespace gsnav::io
