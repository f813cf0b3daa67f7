// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/mesh/mesh.hpp"
#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/scene/lod_choice.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

namespace gsnav {

struct LodTree;  // gsnav/scene/lod_tree.hpp
struct PackedCloud;
struct PlacedMeshes;  // gsnav/detail/scene/placed_meshes.hpp
struct SceneBands;
struct VisibleSets;

/// Static Gaussians of a scene, as floats or packed, with their transform. Set either `cloud` or
/// `packed`.
struct SceneAsset {
  std::shared_ptr<const GaussianCloud> cloud;  ///< Gaussians stored as floats. Null if `packed` is set.
  Similarity world_from_asset{};               ///< Transform from the asset's frame to the world.
  /// Level-of-detail tree (build_lod, io::cached_lod). Required if SimulatorConfig::lod is set.
  std::shared_ptr<const LodTree> lod{};
  /// Gaussians visible from each cell of space (build_visible_sets, io::cached_visible_sets). Required
  /// if SimulatorConfig::visible_sets is set.
  std::shared_ptr<const VisibleSets> visible{};
  /// Gaussians stored in packed form, in place of `cloud`. They have no levels of detail and no visible
  /// sets.
  std::shared_ptr<const PackedCloud> packed{};
  /// SH bands to read per chunk (scene_bands). Null: all. Levels of detail always read all bands.
  std::shared_ptr<const SceneBands> bands{};

  /// Sort order of the cloud that is set. @pre `cloud` or `packed` is set.
  SortOrder sort_order() const noexcept;
};

/// Triangle mesh in a scene, composited with the Gaussians (docs/reference/composition.md).
struct SceneMesh {
  std::shared_ptr<const PlacedMeshes> surface;  ///< Triangles and their materials.
  Similarity world_from_surface{};              ///< Transform from the mesh's frame to the world.
};

/// Everything that a simulator runs in. It does not change, so simulators can share it.
struct SimulatorScene {
  std::vector<SceneAsset> assets;          ///< Static Gaussians.
  std::vector<SceneMesh> meshes;           ///< Triangle meshes.
  MeshLight light{};                       ///< Light on the meshes.
  std::shared_ptr<const NavMesh> navmesh;  ///< Surface that agents walk on.
  std::vector<AvatarActor> avatars;        ///< People with their motions and trajectories.
};

/// Which part of a scene's assets is drawn.
struct DetailChoice {
  std::optional<LodChoice> lod{};  ///< Level of detail. Empty: the assets as they are.
  bool visible_sets = false;       ///< Draw only the Gaussians that are visible from the camera's cell.

  /// Whether assets are drawn by their trees of levels.
  bool has_trees() const noexcept { return lod && !lod->bodies_only; }
};

/// Checks that a scene is complete enough to simulate.
/// @return invalid_argument, with the part that is missing.
Status validate(const SimulatorScene& scene);
/// Checks that a scene is complete enough to render. A NavMesh is not required.
/// @return invalid_argument, with the part that is missing.
Status validate_assets(const SimulatorScene& scene);

/// Checks that a scene has the data that `choice` needs.
/// @return invalid_argument, with the part that is missing or out of range.
Status validate_detail(const SimulatorScene& scene, const DetailChoice& choice);

/// Appends the motion of the scene's avatars over [t0, t1], numbered in scene order.
/// @param scene Scene with the avatars.
/// @param t0, t1 Interval on the scene's clock, seconds.
/// @param out Receives the moving capsules.
/// @param before The capsules of an interval that ended at t0, or null. They halve the time and do not
/// change the result.
void append_bodies(const SimulatorScene& scene, double t0, double t1, std::vector<DynamicCapsule>& out,
                   const CapsuleSet* before = nullptr);

}  // namespace gsnav
