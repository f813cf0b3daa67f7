// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"

namespace gsnav {

/// Many actors' Gaussians on one backend, skinned together: their joint matrices go there in one copy,
/// and a GPU skins all of them in one launch. Actors of one asset share its canonical arrays. Positions
/// are the bits that SkinnedGaussians gives. The backend must outlive it.
///
///     SkinnedCrowd crowd(backend);
///     for (const AvatarActor& a : people) crowd.add(a.asset());
///     crowd.pose(people, t).throw_if_error();
///     crowd.set(0);   // of people[0], to be rendered with the scene
template <Backend B>
class SkinnedCrowd {
 public:
  /// An empty crowd in the backend's memory.
  explicit SkinnedCrowd(B& backend) : backend_(&backend), joints_(backend) {}

  /// Makes room for one more actor, of this asset, and returns its place.
  std::size_t add(const std::shared_ptr<const AvatarAsset>& asset) {
    std::shared_ptr<const AvatarArrays<B>> arrays;
    for (const auto& known : assets_) {
      if (known->asset() == asset) arrays = known;
    }
    if (arrays == nullptr)
      assets_.push_back(arrays = std::make_shared<const AvatarArrays<B>>(*backend_, asset));
    return add(std::move(arrays));
  }
  /// The same of an asset's arrays that others share.
  std::size_t add(std::shared_ptr<const AvatarArrays<B>> arrays) {
    actors_.emplace_back(*backend_, std::move(arrays));
    return actors_.size() - 1;
  }

  /// Poses actors[i] (or *actors[i]) at place i as it is at time t (seconds); those that are not in the
  /// scene then have empty sets. Errors: invalid_argument where there are not as many actors as places,
  /// or one has another asset than its place; no set changes its Gaussians then.
  Status pose(std::span<const AvatarActor> actors, double t) {
    return pose(
        actors.size(), [&](std::size_t i) -> const AvatarActor& { return actors[i]; }, t);
  }
  Status pose(std::span<const AvatarActor* const> actors, double t) {
    return pose(
        actors.size(), [&](std::size_t i) -> const AvatarActor& { return *actors[i]; }, t);
  }

  /// Poses them for what these cameras see by `config`, in two steps, as SkinnedGaussians::prepare has
  /// it: the first is the host's alone, and several threads may take it, each for a crowd of its own.
  /// Errors as above.
  Status prepare(std::span<const AvatarActor> actors, double t, std::span<const Camera> cameras,
                 const RenderConfig& config) {
    if (Status s = check(actors.size()); !s) return s;
    for (std::size_t i = 0; i < actors.size(); ++i) {
      if (Status s = at_place(i, actors_[i].prepare(actors[i], t, cameras, config)); !s) return s;
    }
    return {};
  }
  /// Skins what prepare() found visible. Errors: as of skin().
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

  /// Number of actors.
  std::size_t size() const noexcept { return actors_.size(); }
  /// The posed Gaussians at a place; valid until the next pose().
  GaussianSet set(std::size_t place) const& noexcept { return actors_[place].set(); }
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
