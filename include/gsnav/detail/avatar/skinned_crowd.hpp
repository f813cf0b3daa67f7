// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"

namespace gsnav {

/// The Gaussians of many actors on one backend, skinned together. Their joint matrices are uploaded in
/// one copy, and a GPU skins all actors in one launch. Actors of one asset share its canonical arrays.
/// Positions have the same bits as with SkinnedGaussians. The backend must outlive this object.
///
///     SkinnedCrowd crowd(backend);
///     for (const AvatarActor& a : people) crowd.add(a.asset());
///     crowd.pose(people, t).throw_if_error();
///     crowd.set(0);   // of people[0], to be rendered with the scene
template <Backend B>
class SkinnedCrowd {
 public:
  /// Keeps a pointer to `backend`.
  explicit SkinnedCrowd(B& backend) : backend_(&backend), joints_(backend) {}

  /// Adds a place for an actor of this asset and returns the place's index.
  std::size_t add(const std::shared_ptr<const AvatarAsset>& asset) {
    std::shared_ptr<const AvatarArrays<B>> arrays;
    for (const auto& known : assets_) {
      if (known->asset() == asset) arrays = known;
    }
    if (arrays == nullptr)
      assets_.push_back(arrays = std::make_shared<const AvatarArrays<B>>(*backend_, asset));
    return add(std::move(arrays));
  }
  /// Adds a place for an actor of an asset whose arrays are shared with others.
  std::size_t add(std::shared_ptr<const AvatarArrays<B>> arrays) {
    actors_.emplace_back(*backend_, std::move(arrays));
    return actors_.size() - 1;
  }

  /// Poses actors[i] (or *actors[i]) at place i, for time t (seconds). The sets of actors that are not
  /// in the scene then are empty. Error: invalid_argument if the numbers of actors and places differ, or
  /// an actor's asset is not that of its place; no Gaussians are changed then.
  Status pose(std::span<const AvatarActor> actors, double t) {
    return pose(
        actors.size(), [&](std::size_t i) -> const AvatarActor& { return actors[i]; }, t);
  }
  /// The same for pointers to actors.
  Status pose(std::span<const AvatarActor* const> actors, double t) {
    return pose(
        actors.size(), [&](std::size_t i) -> const AvatarActor& { return *actors[i]; }, t);
  }

  /// Poses the actors for rendering with `config` from these cameras, in two steps like
  /// SkinnedGaussians::prepare. The first step runs on the host only; several threads may prepare
  /// different crowds at once. Errors: as above.
  Status prepare(std::span<const AvatarActor> actors, double t, std::span<const Camera> cameras,
                 const RenderConfig& config) {
    if (Status s = check(actors.size()); !s) return s;
    for (std::size_t i = 0; i < actors.size(); ++i) {
      if (Status s = at_place(i, actors_[i].prepare(actors[i], t, cameras, config)); !s) return s;
    }
    return {};
  }
  /// Second step of `pose`: skins all actors that some camera sees.
  Status skin_prepared() {
    host_joints_.clear();
    for (SkinnedGaussians<B>& a : actors_) {
      if (!a.visible_) continue;
      if (a.asset()->skinning == Skinning::dual_quaternion) a.set_dual_joints(a.matrices_);
      for (const auto& m : a.matrices_) host_joints_.push_back(affine_cast<float>(m));
    }
    joints_.upload(host_joints_.data(), host_joints_.size());
    jobs_.clear();
    std::size_t first = 0;
    for (SkinnedGaussians<B>& a : actors_) {
      if (!a.visible_) continue;
      const std::size_t joints = a.asset()->skeleton.size();
      a.args_.joints = {joints_.data() + first, joints};
      first += joints;
      jobs_.push_back(a.args_);
    }
    return skin_all<float, B, float>(*backend_, jobs_);
  }

  /// Number of places.
  std::size_t size() const noexcept { return actors_.size(); }
  /// The posed Gaussians of a place. Valid until the next pose().
  GaussianSet set(std::size_t place) const& noexcept { return actors_[place].set(); }
  /// Deleted for temporaries, because the set refers to the crowd's buffers.
  GaussianSet set(std::size_t place) const&& = delete;

 private:
  template <class ActorAt>
  Status pose(std::size_t count, const ActorAt& actor_at, double t) {
    if (Status s = check(count); !s) return s;
    for (std::size_t i = 0; i < count; ++i) {
      if (Status s = at_place(i, actors_[i].place(actor_at(i), t)); !s) return s;
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (actors_[i].visible_) actor_at(i).joint_matrices(t, actors_[i].matrices_);
    }
    return skin_prepared();
  }
  Status check(std::size_t actors) const {
    if (actors == actors_.size()) return {};
    return {Errc::invalid_argument, "SkinnedCrowd: " + std::to_string(actors) + " actors for " +
                                        std::to_string(actors_.size()) +
                                        " places; call add() once for each"};
  }
  static Status at_place(std::size_t i, const Status& s) {
    return s ? s : Status(s.code(), "SkinnedCrowd: place " + std::to_string(i) + ": " + s.message());
  }

  B* backend_;
  std::vector<std::shared_ptr<const AvatarArrays<B>>> assets_;
  std::vector<SkinnedGaussians<B>> actors_;
  Buffer<Affine3<float>, B> joints_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<SkinningArgs<float>> jobs_;
};

}  // namespace gsnav
