// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "gltf_nodes.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"

namespace gsnav::io::detail {

constexpr std::size_t kNoNode = static_cast<std::size_t>(-1);

/// One of the file's skins on a rig that skins may share.
struct GltfSkinPart {
  std::size_t index = 0;              ///< among the file's skins
  std::vector<std::size_t> joint_of;  ///< the skeleton's joint of each entry of its list
  Affine3<double> rig_from_mesh{};  ///< takes its vertices to where the rig's inverse binds expect them
};

/// A rig: the file's own matrices, and the rigid skeleton made of them.
struct GltfSkin {
  std::vector<std::size_t> nodes;   ///< [J] of the skeleton's joints; kNoNode: it keeps its rest pose
  std::vector<GltfSkinPart> parts;  ///< the skins, at least one
  std::vector<Affine3<double>> inverse_binds;  ///< [J] the file's
  Affine3<double> canonical_from_mesh{};       ///< a rotation times a scale, and a translation
  Quatd canonical_from_scene{0, 0, 1, 0};      ///< by 180 degrees about Y: glTF faces +Z
  Skeleton skeleton;
};

/// The rig of the skins that `wanted` names (GltfOptions::skins).
Result<GltfSkin> read_skin(const GltfFile& file, const GltfNodes& nodes,
                           const std::vector<std::string>& wanted);

/// Fills the surface of `out.mesh`, whose skeleton is there. Positions are those of the bind pose.
Status read_surface(const GltfFile& file, const GltfSkin& skin, LoadedSkinnedMesh& out);

/// Joints without their scales, root frame, for the places of the nodes: [J].
std::vector<Affine3<double>> rigid_joints(const GltfSkin& skin,
                                          const std::vector<Affine3<double>>& globals);

/// Fills `out` and tells `warnings`; `look` is called with the places of all nodes at every tenth key or
/// so.
struct PoseObserver {
  virtual ~PoseObserver() = default;
  virtual void look(const std::vector<Affine3<double>>& globals) = 0;
};
Status read_clips(const GltfFile& file, const GltfSkin& skin, const GltfNodes& nodes, double frame_rate,
                  PoseObserver& observer, std::vector<NamedClip>& out,
                  std::vector<std::string>& warnings);

}  // namespace gsnav::io::detail
