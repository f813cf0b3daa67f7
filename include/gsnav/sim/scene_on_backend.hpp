// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/skinned_gaussians.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/renderer.hpp"

namespace gsnav {

/// A cloud and how it stands in the world.
struct SceneAsset {
  std::shared_ptr<const GaussianCloud> cloud;
  Similarity world_from_asset{};
};

/// What a simulator runs in. Shared, never changed: many simulators may use one.
struct SimulatorScene {
  std::vector<SceneAsset> assets;
  std::shared_ptr<const NavMesh> navmesh;
  std::vector<AvatarActor> avatars;
};

/// invalid_argument, naming the part, where something is missing.
inline Status validate(const SimulatorScene& scene) {
  if (scene.navmesh == nullptr) return {Errc::invalid_argument, "SimulatorScene.navmesh is null"};
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    if (scene.assets[i].cloud == nullptr) {
      return {Errc::invalid_argument, "SimulatorScene.assets[" + std::to_string(i) + "].cloud is null"};
    }
  }
  return {};
}

/// Appends how the scene's avatars move over [t0, t1], numbered as they stand in the scene.
inline void append_bodies(const SimulatorScene& scene, double t0, double t1, std::vector<DynamicCapsule>& out) {
  for (std::size_t i = 0; i < scene.avatars.size(); ++i) {
    scene.avatars[i].dynamic_capsules(t0, t1, static_cast<std::uint32_t>(i), out);
  }
}

/// A scene in a backend's memory, its avatars posed for one or a few times at once. Each time that is held needs the
/// avatars' means and orientations once more, so what this takes grows with `slots`, not with who looks.
template <Backend B>
class SceneOnBackend {
 public:
  SceneOnBackend(B& backend, std::shared_ptr<const SimulatorScene> scene) : backend_(&backend), scene_(std::move(scene)) {
    for (const SceneAsset& a : scene_->assets) {
      arrays_.emplace_back(backend, *a.cloud);
      sets_.push_back(arrays_.back().set(a.world_from_asset));
    }
  }

  const SimulatorScene& scene() const noexcept { return *scene_; }
  /// `config` with the sort order of the scene's assets.
  RenderConfig render_config(RenderConfig config) const noexcept {
    if (!scene_->assets.empty()) config.sort_order = scene_->assets.front().cloud->sort_order;
    return config;
  }
  /// The scene without its avatars.
  std::span<const GaussianSet> assets() const noexcept { return sets_; }
  /// How many times an avatar was posed so far.
  std::size_t pose_count() const noexcept { return pose_count_; }

  /// Poses slot `slot` for time t, for whoever looks; nothing is done where it is so already.
  Status pose(std::size_t slot, double t) {
    Slot& s = at(slot);
    if (s.whole && s.time == t) return {};
    return pose(s, t, true, [&](std::size_t i) { return s.skins[i].pose(scene_->avatars[i], t); });
  }
  /// The same for what these cameras see: avatars that none of them can see cost little.
  Status pose(std::size_t slot, double t, std::span<const Camera> cameras, const RenderConfig& config) {
    Slot& s = at(slot);
    return pose(s, t, false, [&](std::size_t i) { return s.skins[i].pose(scene_->avatars[i], t, cameras, config); });
  }
  /// Assets, then avatars, as last posed. Valid until the slot is posed again.
  std::span<const GaussianSet> sets(std::size_t slot) const noexcept { return slots_[slot]->sets; }

 private:
  struct Slot {
    std::vector<SkinnedGaussians<B>> skins;
    std::vector<GaussianSet> sets;
    double time = 0.0;
    bool whole = false;  // posed for any camera
  };

  Slot& at(std::size_t slot) {
    while (slots_.size() <= slot) {
      auto s = std::make_unique<Slot>();
      for (const AvatarActor& actor : scene_->avatars) s->skins.emplace_back(*backend_, actor.asset());
      slots_.push_back(std::move(s));
    }
    return *slots_[slot];
  }

  template <class PoseAvatar>
  Status pose(Slot& s, double t, bool whole, const PoseAvatar& pose_avatar) {
    s.whole = false;
    s.sets = sets_;
    for (std::size_t i = 0; i < s.skins.size(); ++i) {
      if (Status e = pose_avatar(i); !e) return e;
      ++pose_count_;
      s.sets.push_back(s.skins[i].set());
    }
    s.time = t;
    s.whole = whole;
    return {};
  }

  B* backend_;
  std::shared_ptr<const SimulatorScene> scene_;
  std::vector<GaussianArrays<B>> arrays_;
  std::vector<GaussianSet> sets_;  // of the assets
  std::vector<std::unique_ptr<Slot>> slots_;
  std::size_t pose_count_ = 0;
};

}  // namespace gsnav
