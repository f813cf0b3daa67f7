// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gsnav/avatar/skinned_gaussians.hpp"

namespace gsnav {

/// Actors of any number of crowds that are skinned together: their joint matrices are uploaded in one
/// copy, and a GPU skins all of them in one launch.
template <Backend B>
class SkinningBatch {
 public:
  /// Keeps a pointer to `backend`.
  explicit SkinningBatch(B& backend) : backend_(&backend), joints_(backend) {}

  /// Adds the joints of an actor. The jobs that are added afterwards read them.
  void add_joints(const std::vector<Affine3<float>>& matrices) {
    first_ = host_joints_.size();
    host_joints_.insert(host_joints_.end(), matrices.begin(), matrices.end());
  }
  /// Adds Gaussians that follow the joints added last. `args` may leave out `joints`.
  void add(const SkinningArgs<float>& args) {
    jobs_.push_back(args);
    firsts_.push_back(first_);
    jobs_.back().joints = {nullptr, host_joints_.size() - first_};
  }
  /// Skins the jobs that were added since the last call.
  /// @return invalid_argument naming the array, and the index of the job.
  Status run() {
    joints_.upload(host_joints_.data(), host_joints_.size());
    for (std::size_t i = 0; i < jobs_.size(); ++i) jobs_[i].joints.data = joints_.data() + firsts_[i];
    const Status s = skin_all<float, B, float>(*backend_, jobs_);
    host_joints_.clear();
    jobs_.clear();
    firsts_.clear();
    return s;
  }

 private:
  B* backend_;
  Buffer<Affine3<float>, B> joints_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<SkinningArgs<float>> jobs_;
  std::vector<std::size_t> firsts_;  // Index of the first joint of each job.
  std::size_t first_ = 0;
};

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
  explicit SkinnedCrowd(B& backend) : backend_(&backend), batch_(backend) {}

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
    return prepare(actors, t, [&](std::size_t, const GaussianSet& set, const ChunkBounds& bounds) {
      std::uint32_t seen = 0;
      for (const Camera& c : cameras)
        seen = seen != 0 || SkinnedGaussians<B>::is_seen(c, config, set, bounds) ? 1 : 0;
      return seen;
    });
  }
  /// The same for chosen levels of detail. wanted(place, set, bounds) returns a bit for each level that
  /// is to be skinned, that of the whole body first. `set` has the body's placement. `bounds` contain
  /// the body in its present pose.
  template <class Wanted>
  Status prepare(std::span<const AvatarActor> actors, double t, const Wanted& wanted) {
    if (Status s = check(actors.size()); !s) return s;
    return prepare_levels(
        actors.size(), [&](std::size_t i) -> const AvatarActor& { return actors[i]; }, t, wanted);
  }
  /// Second step of `pose`: skins all actors that some camera sees.
  Status skin_prepared() {
    add_prepared(batch_);
    return batch_.run();
  }
  /// The same as part of a batch, whose run() then skins them.
  void add_prepared(SkinningBatch<B>& batch) {
    for (SkinnedGaussians<B>& a : actors_) {
      if (a.wanted_ == 0) continue;
      a.for_each_wanted([](const auto&) {});  // allocates
      if (a.asset()->skinning == Skinning::dual_quaternion) a.set_dual_joints(a.matrices_);
      batch.add_joints(a.host_joints_);
      a.for_each_wanted([&](const SkinningArgs<float>& args) { batch.add(args); });
    }
  }

  /// The posed Gaussians of a level of detail of a place, or of the whole body (0). Empty if that level
  /// was not posed.
  GaussianSet set(std::size_t place, std::size_t level) const& noexcept {
    return actors_[place].set_of(level);
  }
  /// Deleted for temporaries, because the set refers to the crowd's buffers.
  GaussianSet set(std::size_t place, std::size_t level) const&& = delete;
  /// A box that contains the Gaussians of a place in its present pose.
  const ChunkBounds& bounds(std::size_t place) const noexcept { return actors_[place].bounds_now_; }
  /// Whether some level of a place is posed.
  bool is_seen(std::size_t place) const noexcept { return actors_[place].wanted_ != 0; }
  /// Whether a level of a place, or the whole body (0), is posed.
  bool is_posed(std::size_t place, std::size_t level) const noexcept {
    return (actors_[place].wanted_ >> level & 1) != 0;
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
      if (Status s = at_place(i, actors_[i].present(actor_at(i), t)); !s) return s;
    }
    const auto all = [](std::size_t, const auto&, const auto&) { return ~std::uint32_t{0}; };
    if (Status s = prepare_levels(count, actor_at, t, all); !s) return s;
    return skin_prepared();
  }
  template <class ActorAt, class Wanted>
  Status prepare_levels(std::size_t count, const ActorAt& actor_at, double t, const Wanted& wanted) {
    for (std::size_t i = 0; i < count; ++i) {
      SkinnedGaussians<B>& a = actors_[i];
      const std::uint32_t levels = (std::uint32_t{1} << a.levels_.size()) - 1;
      const Status s = a.prepare_levels(actor_at(i), t, [&](const auto& set, const auto& bounds) {
        return wanted(i, set, bounds) & levels;
      });
      if (!s) return at_place(i, s);
    }
    return {};
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
  SkinningBatch<B> batch_;
};

}  // namespace gsnav
