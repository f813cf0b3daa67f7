// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/math/similarity.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_cut.hpp"

namespace gsnav {

struct PackedCloud;
struct SceneBands;
struct VisibleSets;

/// A cloud, as floats or packed, and how it stands in the world.
struct SceneAsset {
  std::shared_ptr<const GaussianCloud> cloud;  ///< null where `packed` is set
  Similarity world_from_asset{};               ///< Takes the asset's frame to the world.
  /// Its levels of detail (build_lod, io::cached_lod); read where SimulatorConfig::lod is set.
  std::shared_ptr<const LodTree> lod{};
  /// What is seen of it from where agents go (build_visible_sets, io::cached_visible_sets); read where
  /// SimulatorConfig::visible_sets is set.
  std::shared_ptr<const VisibleSets> visible{};
  /// In place of `cloud`. It has no levels of detail and no visible sets.
  std::shared_ptr<const PackedCloud> packed{};
  /// SH bands that its chunks need (scene_bands), the others are not read; null: all are. Levels of
  /// detail read all.
  std::shared_ptr<const SceneBands> bands{};

  /// Of the cloud that is set; one of `cloud` and `packed` must be.
  SortOrder sort_order() const noexcept;
};

/// A surface of triangles and how it stands in the world; seen among the Gaussians
/// (docs/reference/composition.md).
struct SceneMesh {
  std::shared_ptr<const PlacedMeshes> surface;  ///< The triangles.
  Similarity world_from_surface{};              ///< Takes the surface's frame to the world.
};

/// What a simulator runs in. Shared, never changed: many simulators may use one.
struct SimulatorScene {
  std::vector<SceneAsset> assets;          ///< Clouds of Gaussians.
  std::vector<SceneMesh> meshes;           ///< Surfaces of triangles.
  MeshLight light{};                       ///< of the meshes
  std::shared_ptr<const NavMesh> navmesh;  ///< The walkable surface.
  std::vector<AvatarActor> avatars;        ///< People.
};

/// What of a scene's assets is drawn.
struct DetailChoice {
  std::optional<LodChoice> lod{};  ///< by levels of detail; none: whole
  bool visible_sets = false;       ///< only what is seen from where the camera is
};

/// invalid_argument, naming the part, where something is missing.
Status validate(const SimulatorScene& scene);
/// The same of what is drawn: a NavMesh may be missing.
Status validate_assets(const SimulatorScene& scene);

/// Whether a scene can be drawn so. invalid_argument, naming what is missing or out of range.
Status validate_detail(const SimulatorScene& scene, const DetailChoice& choice);

/// Appends how the scene's avatars move over [t0, t1], numbered as they stand in the scene. `before`:
/// what this gave for an interval that ended at t0, or null; with it the same comes in half the time.
void append_bodies(const SimulatorScene& scene, double t0, double t1, std::vector<DynamicCapsule>& out,
                   const CapsuleSet* before = nullptr);

}  // namespace gsnav
