// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gltf_nodes.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"

namespace gsnav::io::detail {

constexpr std::size_t kNoNode = static_cast<std::size_t>(-1);

/// One of the file's skins, on a rig that it may share with others.
struct GltfSkinPart {
  std::size_t index = 0;              ///< Index among the file's skins.
  std::vector<std::size_t> joint_of;  ///< For each entry of the skin's list, the joint of the skeleton.
  Affine3<double> rig_from_mesh{};    ///< Maps the skinned mesh's vertices to the space that the rig's
                                      ///< inverse bind matrices expect.
};

/// A rig: the file's matrices, and the rigid skeleton made from them.
struct GltfSkin {
  std::vector<std::size_t> nodes;   ///< [J] node of each joint; kNoNode: the joint keeps its rest pose.
  std::vector<GltfSkinPart> parts;  ///< The skins, at least one.
  std::vector<Affine3<double>> inverse_binds;  ///< [J] as in the file.
  Affine3<double> canonical_from_mesh{};       ///< A rotation times a scale, and a translation.
  Quatd canonical_from_scene{0, 0, 1, 0};      ///< Half a turn about Y, because glTF faces +Z.
  Skeleton skeleton;
};

/// Reads the rig of the skins in `wanted` (GltfOptions::skins).
Result<GltfSkin> read_skin(const GltfFile& file, const GltfNodes& nodes,
                           const std::vector<std::string>& wanted);

/// Fills the surface of `out.mesh`, whose skeleton must be complete. Positions are those of the bind
/// pose.
Status read_surface(const GltfFile& file, const GltfSkin& skin, LoadedSkinnedMesh& out);

/// The joints without their scales, in the root frame, for the given transforms of the nodes: [J].
std::vector<Affine3<double>> rigid_joints(const GltfSkin& skin,
                                          const std::vector<Affine3<double>>& globals);

/// Receives the transforms of all nodes from read_clips, in about every tenth frame of a clip.
struct PoseObserver {
  virtual ~PoseObserver() = default;
  virtual void look(const std::vector<Affine3<double>>& globals) = 0;
};
/// Reads all animations of the file as clips for `skin`. Appends to `out` and `warnings`. Errors: those
/// of load_gltf_skin.
Status read_clips(const GltfFile& file, const GltfSkin& skin, const GltfNodes& nodes, double frame_rate,
                  PoseObserver& observer, std::vector<NamedClip>& out,
                  std::vector<std::string>& warnings);

}  // namespace gsnav::io::detail
