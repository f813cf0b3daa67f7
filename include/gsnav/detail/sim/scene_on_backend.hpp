// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/sim/body_levels.hpp"
#include "gsnav/detail/sim/scene_levels.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/sim/scene.hpp"

namespace gsnav {

/// A scene in a backend's memory, with avatars posed for one or more times. Each pose slot holds the
/// means and orientations of all avatars, so memory grows with the number of slots, not with the number
/// of views.
template <Backend B>
class SceneOnBackend {
 public:
  /// Uploads a scene.
  /// @param choice Levels of detail and visible sets to use. The scene must have them (validate_detail).
  SceneOnBackend(B& backend, std::shared_ptr<const SimulatorScene> scene,
                 const DetailChoice& choice = {})
      : backend_(&backend), scene_(std::move(scene)) {
    if (choice.lod) levels_.choice = *choice.lod;
    if (!scene_->assets.empty()) lod_ = choice.lod;
    for (const SceneAsset& a : scene_->assets) {
      const bool trees = choice.has_trees();
      arrays_.push_back(arrays_of(a, trees ? nullptr : a.bands.get()));
      sets_.push_back(arrays_.back().set(a.world_from_asset));
      if (!choice.lod && !choice.visible_sets) continue;
      levels_.assets.push_back({trees ? a.lod.get() : nullptr, a.cloud.get(), a.world_from_asset});
      if (choice.visible_sets) levels_.assets.back().visible = a.visible.get();
      if constexpr (!is_host_backend<B>) {
        if (choice.visible_sets) {
          visible_.emplace_back(backend).upload(a.visible->bits.data(), a.visible->bits.size());
          levels_.assets.back().visible_there = visible_.back().data();
        }
        if (!trees) continue;
        levels_.assets.back().cloud_there = sets_.back().gaussians;
        if (a.lod->merged.size() == 0) continue;
        levels_.assets.back().merged_there =
            merged_.emplace_back(backend, a.lod->merged).set().gaussians;
      }
    }
    for (std::size_t m = 0; m < scene_->meshes.size(); ++m) place(m);
    // Avatars with the same asset share its arrays.
    for (const AvatarActor& actor : scene_->avatars) {
      std::shared_ptr<const AvatarArrays<B>> body;
      for (const auto& known : bodies_) body = known->asset() == actor.asset() ? known : body;
      bodies_.push_back(body != nullptr ? body
                                        : std::make_shared<const AvatarArrays<B>>(backend, actor.asset(),
                                                                                  lod_.has_value()));
    }
  }

  /// The scene.
  const SimulatorScene& scene() const noexcept { return *scene_; }
  /// `config` with the sort order of the scene's assets and, if used, the rules of levels of detail or
  /// visible sets.
  RenderConfig render_config(RenderConfig config) const noexcept {
    if (levels() != nullptr) config = lod_config(config);
    if (!scene_->assets.empty()) config.sort_order = scene_->assets.front().sort_order();
    return config;
  }
  /// Levels of detail of the avatars of a slot, if levels were asked for. Valid until the slot is posed
  /// again.
  std::span<const BodyLevels> bodies(std::size_t slot) const noexcept { return slots_[slot]->bodies; }
  /// Sets of the assets, without avatars.
  std::span<const GaussianSet> assets() const noexcept { return sets_; }
  /// Meshes of the scene. The id of an instance is the index of its SceneMesh.
  MeshFrame meshes() const noexcept { return {instances_, scene_->light}; }
  /// How the assets are selected per camera. Null: draw them whole.
  const LeveledScene* levels() const noexcept { return levels_.assets.empty() ? nullptr : &levels_; }
  /// Number of times that an avatar was posed so far.
  std::size_t pose_count() const noexcept { return pose_count_; }

  /// Poses slot `slot` for time t (seconds on the scene's clock), for any camera. Does nothing if the
  /// slot has this pose.
  /// @return an error of skinning.
  Status pose(std::size_t slot, double t) {
    Slot& s = at(slot);
    if (s.whole && s.time == t) return {};
    s.whole = false;
    if (Status e = s.people.pose(scene_->avatars, t); !e) return e;
    list_sets(s, true);
    list_bodies(s);
    pose_count_ += s.people.size();
    s.time = t;
    s.whole = true;
    return {};
  }
  /// Poses slot `slot` for certain cameras, in two steps: prepare(), then pose_prepared(). Avatars that
  /// no camera can see cost little. prepare() runs on the host only; several threads may call it for
  /// different slots after make_slots().
  /// @param whole_bodies whether whole bodies are drawn besides their levels of detail. Otherwise, and
  /// without levels of detail, sets() leaves out the avatars that no camera can see.
  /// @return an error of skinning.
  Status prepare(std::size_t slot, double t, std::span<const Camera> cameras, const RenderConfig& config,
                 bool whole_bodies = false) {
    Slot& s = *slots_[slot];
    s.whole = false;
    s.time = t;
    const auto wanted = [&](std::size_t i, const GaussianSet& body, const ChunkBounds& bounds) {
      const AvatarAsset& asset = *scene_->avatars[i].asset();
      std::uint32_t levels = 0;
      for (const Camera& c : cameras) {
        if (!SkinnedGaussians<B>::is_seen(c, config, body, bounds)) continue;
        levels |= whole_bodies || !lod_ ? 1 : 0;
        if (lod_)
          levels |= std::uint32_t{1} << level_of_body(asset, body.world_from_asset, bounds, c, *lod_);
      }
      return levels;
    };
    if (Status e = s.people.prepare(scene_->avatars, t, wanted); !e) return e;
    list_sets(s, whole_bodies || lod_);
    return {};
  }
  /// Second step of prepare(): skins the Gaussians, as part of a batch that the caller runs.
  void pose_prepared(std::size_t slot, SkinningBatch<B>& batch) {
    Slot& s = *slots_[slot];
    s.people.add_prepared(batch);
    list_bodies(s);
    pose_count_ += s.people.size();
  }
  /// Creates slots 0 to count - 1.
  void make_slots(std::size_t count) {
    if (count > 0) at(count - 1);
  }
  /// Sets of a slot, assets first, then avatars. Valid until the slot is posed again.
  std::span<const GaussianSet> sets(std::size_t slot) const noexcept { return slots_[slot]->sets; }

 private:
  struct Slot {
    explicit Slot(B& backend) : people(backend) {}
    SkinnedCrowd<B> people;
    std::vector<GaussianSet> sets;
    std::vector<BodyLevels> bodies;
    double time = 0.0;
    bool whole = false;  // True if posed for any camera.
  };

  Slot& at(std::size_t slot) {
    while (slots_.size() <= slot) {
      auto s = std::make_unique<Slot>(*backend_);
      for (const auto& body : bodies_) s->people.add(body);
      slots_.push_back(std::move(s));
    }
    return *slots_[slot];
  }

  GaussianArrays<B> arrays_of(const SceneAsset& asset, const SceneBands* bands) const {
    const auto of = [&](const auto& cloud) {
      return bands != nullptr ? GaussianArrays<B>(*backend_, cloud, *bands)
                              : GaussianArrays<B>(*backend_, cloud);
    };
    return asset.packed != nullptr ? of(*asset.packed) : of(*asset.cloud);
  }

  void place(std::size_t mesh) {
    const SceneMesh& m = scene_->meshes[mesh];
    std::vector<std::size_t> at(m.surface->meshes.size());
    for (std::size_t part = 0; part < at.size(); ++part) {
      at[part] = mesh_arrays_.size();
      mesh_arrays_.emplace_back(*backend_, m.surface->meshes.view(part));
    }
    for (const TexturedScene::Instance& i : m.surface->instances) {
      instances_.push_back(mesh_arrays_[at[i.part]].instance(m.world_from_surface * i.world_from_part,
                                                             static_cast<std::uint32_t>(mesh)));
    }
  }

  void list_bodies(Slot& s) const {
    if (!lod_) return;
    s.bodies.resize(s.people.size());
    for (std::size_t i = 0; i < s.bodies.size(); ++i) {
      const AvatarAsset& asset = *scene_->avatars[i].asset();
      BodyLevels& b = s.bodies[i];
      b.asset = s.people.is_seen(i) && !asset.levels.empty() ? &asset : nullptr;
      if (b.asset == nullptr) continue;
      b.bounds = s.people.bounds(i);
      b.sets.clear();
      b.levels.clear();
      for (std::size_t l = 0; l <= asset.levels.size(); ++l) {
        if (!s.people.is_posed(i, l)) continue;
        b.sets.push_back(filtered_for_photo(s.people.set(i, l), *lod_));
        b.levels.push_back(l);
        b.world_from_body = b.sets.back().world_from_asset;
      }
    }
  }
  /// @param all whether avatars that are not posed have a set too, an empty one.
  void list_sets(Slot& s, bool all) const {
    s.sets = sets_;
    for (std::size_t i = 0; i < s.people.size(); ++i) {
      if (all || s.people.is_seen(i)) s.sets.push_back(s.people.set(i));
    }
  }

  B* backend_;
  std::shared_ptr<const SimulatorScene> scene_;
  std::optional<LodChoice> lod_;
  std::vector<GaussianArrays<B>> arrays_;
  std::vector<GaussianSet> sets_;          // Assets.
  std::vector<GaussianArrays<B>> merged_;  // Merged Gaussians of the trees, if the backend has its own
                                           // memory.
  std::vector<Buffer<std::uint32_t, B>> visible_;  // Bits of the visible sets, likewise.
  LeveledScene levels_;
  std::vector<MeshArrays<B>> mesh_arrays_;
  std::vector<MeshInstance> instances_;
  std::vector<std::shared_ptr<const AvatarArrays<B>>> bodies_;  // One per avatar.
  std::vector<std::unique_ptr<Slot>> slots_;
  std::size_t pose_count_ = 0;
};

}  // namespace gsnav
