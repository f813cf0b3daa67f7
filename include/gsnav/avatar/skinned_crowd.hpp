// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"

namespace gsnav {

/// Many actors' Gaussians on one backend, skinned together: their joint matrices go there in one copy, and a GPU
/// skins all of them in one launch. Actors of one asset share its canonical arrays. Positions are the bits that
/// SkinnedGaussians gives. The backend must outlive it.
///
///     SkinnedCrowd crowd(backend);
///     for (const AvatarActor& a : people) crowd.add(a.asset());
///     crowd.pose(people, t).throw_if_error();
///     crowd.set(0);   // of people[0], to be rendered with the scene
template <Backend B>
class SkinnedCrowd {
 public:
  explicit SkinnedCrowd(B& backend) : backend_(&backend), joints_(backend) {}

  /// Makes room for one more actor, of this asset, and returns its place.
  std::size_t add(const std::shared_ptr<const AvatarAsset>& asset) {
    std::shared_ptr<const AvatarArrays<B>> arrays;
    for (const auto& known : assets_) {
      if (known->asset() == asset) arrays = known;
    }
    if (arrays == nullptr) assets_.push_back(arrays = std::make_shared<const AvatarArrays<B>>(*backend_, asset));
    actors_.emplace_back(*backend_, std::move(arrays));
    return actors_.size() - 1;
  }

  /// Poses actors[i] (or *actors[i]) at place i as it is at time t (seconds); those that are not in the scene then
  /// have empty sets. Errors: invalid_argument where there are not as many actors as places, or one has another
  /// asset than its place; no set changes its Gaussians then.
  Status pose(std::span<const AvatarActor> actors, double t) {
    return pose(actors.size(), [&](std::size_t i) -> const AvatarActor& { return actors[i]; }, t);
  }
  Status pose(std::span<const AvatarActor* const> actors, double t) {
    return pose(actors.size(), [&](std::size_t i) -> const AvatarActor& { return *actors[i]; }, t);
  }

  std::size_t size() const noexcept { return actors_.size(); }
  /// The posed Gaussians at a place; valid until the next pose().
  GaussianSet set(std::size_t place) const noexcept { return actors_[place].set(); }

 private:
  template <class ActorAt>
  Status pose(std::size_t count, const ActorAt& actor_at, double t) {
    if (count != actors_.size()) {
      return {Errc::invalid_argument, "SkinnedCrowd: " + std::to_string(count) + " actors for " +
                                          std::to_string(actors_.size()) + " places; call add() once for each"};
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (Status s = actors_[i].place(actor_at(i), t); !s) {
        return {s.code(), "SkinnedCrowd: place " + std::to_string(i) + ": " + s.message()};
      }
    }
    host_joints_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      if (!actors_[i].visible_) continue;
      actor_at(i).joint_matrices(t, matrices_);
      if (actors_[i].asset()->skinning == Skinning::dual_quaternion) actors_[i].set_dual_joints(matrices_);
      for (const auto& m : matrices_) host_joints_.push_back(affine_cast<float>(m));
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

  B* backend_;
  std::vector<std::shared_ptr<const AvatarArrays<B>>> assets_;
  std::vector<SkinnedGaussians<B>> actors_;
  Buffer<Affine3<float>, B> joints_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<Affine3<double>> matrices_;
  std::vector<SkinningArgs<float>> jobs_;
};

}  // namespace gsnav
