// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/detail/avatar/skinned_crowd.hpp"
#include "gsnav/detail/nav/obstacles.hpp"
#include "gsnav/detail/scene/placed_meshes.hpp"
#include "gsnav/detail/sim/scene_detail.hpp"
#include "gsnav/nav/navmesh.hpp"
#include "gsnav/scene/renderer.hpp"

namespace gsnav {

/// A cloud and how it stands in the world.
struct SceneAsset {
  std::shared_ptr<const GaussianCloud> cloud;
  Similarity world_from_asset{};
  /// Its levels of detail (build_lod, io::cached_lod); read where SimulatorConfig::lod is set.
  std::shared_ptr<const LodTree> lod{};
  /// What is seen of it from where agents go (build_visible_sets, io::cached_visible_sets); read where
  /// SimulatorConfig::visible_sets is set.
  std::shared_ptr<const VisibleSets> visible{};
};

/// A surface of triangles and how it stands in the world; seen among the Gaussians
/// (docs/composition.md).
struct SceneMesh {
  std::shared_ptr<const PlacedMeshes> surface;
  Similarity world_from_surface{};
};

/// What a simulator runs in. Shared, never changed: many simulators may use one.
struct SimulatorScene {
  std::vector<SceneAsset> assets;
  std::vector<SceneMesh> meshes;
  MeshLight light{};  ///< of the meshes
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
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    if (scene.meshes[i].surface == nullptr) {
      return {Errc::invalid_argument,
              "SimulatorScene.meshes[" + std::to_string(i) + "].surface is null"};
    }
  }
  return {};
}

/// What of a scene's assets is drawn.
struct DetailChoice {
  std::optional<LodChoice> lod{};  ///< by levels of detail; none: whole
  bool visible_sets = false;       ///< only what is seen from where the camera is
};

/// Whether a scene can be drawn so. invalid_argument, naming what is missing or out of range.
inline Status validate_detail(const SimulatorScene& scene, const DetailChoice& choice) {
  if (choice.lod) {
    if (Status s = validate(*choice.lod); !s) return s;
  }
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    const SceneAsset& a = scene.assets[i];
    const auto bad = [i](const std::string& field, const std::string& what) {
      return Status(Errc::invalid_argument, "SimulatorConfig." + field + ": SimulatorScene.assets[" +
                                                std::to_string(i) + "]." + what);
    };
    if (choice.visible_sets &&
        (a.visible == nullptr || a.visible->cloud_chunks != a.cloud->view().chunk_count())) {
      return bad("visible_sets",
                 std::string("visible is ") +
                     (a.visible == nullptr ? "null: build_visible_sets makes it" : "of another cloud"));
    }
    if (!choice.lod) continue;
    if (a.lod != nullptr && a.lod->cloud_chunks() == a.cloud->view().chunk_count()) continue;
    return bad("lod", std::string("lod is ") +
                          (a.lod == nullptr ? "null: build_lod makes it" : "of another cloud"));
  }
  return {};
}

/// Appends how the scene's avatars move over [t0, t1], numbered as they stand in the scene. `before`:
/// what this gave for an interval that ended at t0, or null; with it the same comes in half the time.
inline void append_bodies(const SimulatorScene& scene, double t0, double t1,
                          std::vector<DynamicCapsule>& out, const CapsuleSet* before = nullptr) {
  std::span<const CapsuleSet::Group> there;  // by avatar
  if (before != nullptr) there = before->groups();
  for (std::size_t i = 0; i < scene.avatars.size(); ++i) {
    const auto number = static_cast<std::uint32_t>(i);
    View<const DynamicCapsule> of_it;
    while (!there.empty() && before->capsules_of(there.front())[0].avatar < number)
      there = there.subspan(1);
    if (!there.empty() && before->capsules_of(there.front())[0].avatar == number)
      of_it = before->capsules_of(there.front());
    scene.avatars[i].dynamic_capsules(t0, t1, number, out, of_it);
  }
}

/// A scene in a backend's memory, its avatars posed for one or a few times at once. Each time that is
/// held needs the avatars' means and orientations once more, so what this takes grows with `slots`, not
/// with who looks.
template <Backend B>
class SceneOnBackend {
 public:
  /// `choice`: of levels of detail and visible sets, which the scene has (validate_detail).
  SceneOnBackend(B& backend, std::shared_ptr<const SimulatorScene> scene,
                 const DetailChoice& choice = {})
      : backend_(&backend), scene_(std::move(scene)) {
    if (choice.lod) detail_.choice = *choice.lod;
    for (const SceneAsset& a : scene_->assets) {
      sets_.push_back(arrays_.emplace_back(backend, *a.cloud).set(a.world_from_asset));
      if (!choice.lod && !choice.visible_sets) continue;
      detail_.assets.push_back({choice.lod ? a.lod.get() : nullptr, a.cloud.get(), a.world_from_asset});
      if (choice.visible_sets) detail_.assets.back().visible = a.visible.get();
      if constexpr (!is_host_backend<B>) {
        if (choice.visible_sets) {
          visible_.emplace_back(backend).upload(a.visible->bits.data(), a.visible->bits.size());
          detail_.assets.back().visible_there = visible_.back().data();
        }
        if (!choice.lod) continue;
        detail_.assets.back().cloud_there = sets_.back().gaussians;
        if (a.lod->merged.size() == 0) continue;
        detail_.assets.back().merged_there =
            merged_.emplace_back(backend, a.lod->merged).set().gaussians;
      }
    }
    for (std::size_t m = 0; m < scene_->meshes.size(); ++m) place(m);
    // People of one body share it.
    for (const AvatarActor& actor : scene_->avatars) {
      std::shared_ptr<const AvatarArrays<B>> body;
      for (const auto& known : bodies_) body = known->asset() == actor.asset() ? known : body;
      bodies_.push_back(
          body != nullptr ? body : std::make_shared<const AvatarArrays<B>>(backend, actor.asset()));
    }
  }

  const SimulatorScene& scene() const noexcept { return *scene_; }
  /// `config` with the sort order of the scene's assets, and the rules of levels of detail, or of
  /// visible sets, where it has them.
  RenderConfig render_config(RenderConfig config) const noexcept {
    if (detail() != nullptr) config = lod_config(config);
    if (!scene_->assets.empty()) config.sort_order = scene_->assets.front().cloud->sort_order;
    return config;
  }
  /// The scene without its avatars.
  std::span<const GaussianSet> assets() const noexcept { return sets_; }
  /// The scene's meshes; an instance's id is the number of the SceneMesh that it is of.
  MeshFrame meshes() const noexcept { return {instances_, scene_->light}; }
  /// What its assets are drawn by, each camera by its own cut; null: whole.
  const SceneDetail* detail() const noexcept { return detail_.assets.empty() ? nullptr : &detail_; }
  /// How many times an avatar was posed so far.
  std::size_t pose_count() const noexcept { return pose_count_; }

  /// Poses slot `slot` for time t (seconds on the scene's clock), for whoever looks; nothing is done
  /// where it is so already. Errors: what skinning reports.
  Status pose(std::size_t slot, double t) {
    Slot& s = at(slot);
    if (s.whole && s.time == t) return {};
    return posed(s, t, true, [&] { return s.people.pose(scene_->avatars, t); });
  }
  /// The same for what these cameras see, in two steps: avatars that none of them can see cost little.
  /// The first is the host's alone: several threads may take it, each for another slot, once there are
  /// so many (make_slots). Errors: as of pose.
  Status prepare(std::size_t slot, double t, std::span<const Camera> cameras,
                 const RenderConfig& config) {
    Slot& s = *slots_[slot];
    s.whole = false;
    s.time = t;
    return s.people.prepare(scene_->avatars, t, cameras, config);
  }
  Status pose_prepared(std::size_t slot) {
    Slot& s = *slots_[slot];
    return posed(s, s.time, false, [&] { return s.people.skin_prepared(); });
  }
  void make_slots(std::size_t count) {
    if (count > 0) at(count - 1);
  }
  /// Assets, then avatars, as last posed. Valid until the slot is posed again.
  std::span<const GaussianSet> sets(std::size_t slot) const noexcept { return slots_[slot]->sets; }

 private:
  struct Slot {
    explicit Slot(B& backend) : people(backend) {}
    SkinnedCrowd<B> people;
    std::vector<GaussianSet> sets;
    double time = 0.0;
    bool whole = false;  // posed for any camera
  };

  Slot& at(std::size_t slot) {
    while (slots_.size() <= slot) {
      auto s = std::make_unique<Slot>(*backend_);
      for (const auto& body : bodies_) s->people.add(body);
      slots_.push_back(std::move(s));
    }
    return *slots_[slot];
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

  template <class PosePeople>
  Status posed(Slot& s, double t, bool whole, const PosePeople& pose_people) {
    s.whole = false;
    if (Status e = pose_people(); !e) return e;
    pose_count_ += s.people.size();
    s.sets = sets_;
    for (std::size_t i = 0; i < s.people.size(); ++i) s.sets.push_back(s.people.set(i));
    s.time = t;
    s.whole = whole;
    return {};
  }

  B* backend_;
  std::shared_ptr<const SimulatorScene> scene_;
  std::vector<GaussianArrays<B>> arrays_;
  std::vector<GaussianSet> sets_;          // of the assets
  std::vector<GaussianArrays<B>> merged_;  // of their trees, where the backend has a memory of its own
  std::vector<Buffer<std::uint32_t, B>> visible_;  // their visible sets, likewise
  SceneDetail detail_;
  std::vector<MeshArrays<B>> mesh_arrays_;
  std::vector<MeshInstance> instances_;
  std::vector<std::shared_ptr<const AvatarArrays<B>>> bodies_;  // of each avatar
  std::vector<std::unique_ptr<Slot>> slots_;
  std::size_t pose_count_ = 0;
};

}  // namespace gsnav
