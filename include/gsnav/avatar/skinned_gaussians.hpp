// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/core/backend.hpp"
#include "gsnav/core/buffer.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/avatar/body_bounds.hpp"
#include "gsnav/detail/core/move_to.hpp"
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/render/rules.hpp"
#include "gsnav/render/config.hpp"
#include "gsnav/skin/skin.hpp"

namespace gsnav {

/// What all actors of an asset share, in the memory of a backend. On host backends it is the asset's
/// own; others get a copy. The backend must outlive it.
template <Backend B>
class AvatarArrays {
 public:
  /// Copies the avatar to the backend's memory.
  AvatarArrays(B& backend, std::shared_ptr<const AvatarAsset> asset) : asset_(std::move(asset)) {
    set_ = asset_->cloud.set();
    GaussianRows& v = set_.gaussians;
    args_.influences = asset_->influences;
    args_.joint_indices = view_of(asset_->joint_indices);
    args_.weights = view_of(asset_->skinning_weights);
    if constexpr (!is_host_backend<B>) {
      detail::move_to(backend, v.shape.means, floats_);
      detail::move_to(backend, v.shape.quats, floats_);
      detail::move_to(backend, v.shape.scales, floats_);
      detail::move_to(backend, v.shape.opacities, floats_);
      detail::move_to(backend, v.color.sh0, floats_);
      detail::move_to(backend, v.color.shN, floats_);
      detail::move_to(backend, args_.joint_indices, shorts_);
      detail::move_to(backend, args_.weights, shorts_);
    }
    if (asset_->skinning == Skinning::linear_stretched) {
      args_.weight_gradients = view_of(asset_->weight_gradients);
      if constexpr (!is_host_backend<B>) detail::move_to(backend, args_.weight_gradients, floats_);
      for (std::size_t k = 0; k < 3; ++k) args_.scales[k] = v.shape.scales[k];
    }
    for (std::size_t k = 0; k < 3; ++k) args_.means[k] = v.shape.means[k];
    for (std::size_t k = 0; k < 4; ++k) args_.quats[k] = v.shape.quats[k];
  }

  /// The avatar that it shows.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return asset_; }
  /// The canonical Gaussians; valid while this lives.
  const GaussianSet& set() const& noexcept { return set_; }
  const GaussianSet& set() const&& = delete;
  /// Without joints and outputs.
  const SkinningArgs<float>& skinning() const& noexcept { return args_; }
  const SkinningArgs<float>& skinning() const&& = delete;

 private:
  std::shared_ptr<const AvatarAsset> asset_;
  GaussianSet set_;
  SkinningArgs<float> args_;
  std::vector<Buffer<std::uint16_t, B>> shorts_;
  std::vector<Buffer<float, B>> floats_;
};

/// The Gaussians of one actor, posed on a backend and ready to be rendered in one list with the scene.
/// Only means and orientations (for SH of degree >= 1 also the rotations that colours are turned back
/// by, with stretch the shapes) are written per frame, into buffers that are used again; all else is the
/// asset's own memory, which on other than host backends is uploaded once. The backend must outlive it.
///
///     SkinnedGaussians skin(backend, actor.asset());
///     skin.pose(actor, t).throw_if_error();
///     renderer.render({{cloud.set(), skin.set()}}, cameras);
template <Backend B>
class SkinnedGaussians {
 public:
  /// Copies the avatar to the backend's memory.
  SkinnedGaussians(B& backend, std::shared_ptr<const AvatarAsset> asset)
      : SkinnedGaussians(backend, std::make_shared<const AvatarArrays<B>>(backend, std::move(asset))) {}
  /// Shares arrays that are already in the backend's memory.
  SkinnedGaussians(B& backend, std::shared_ptr<const AvatarArrays<B>> arrays)
      : backend_(&backend),
        arrays_(std::move(arrays)),
        bounds_(*asset()),
        args_(arrays_->skinning()),
        set_(arrays_->set()),
        joints_(backend),
        dual_joints_(backend) {
    ShapeRows& v = set_.gaussians.shape;
    ColorRows& color = set_.gaussians.color;
    for (std::size_t k = 0; k < 3; ++k) v.means.set(k, args_.means_out[k] = output(v.size));
    for (std::size_t k = 0; k < 4; ++k) {
      v.quats.set(k, args_.quats_out[k] = output(v.size));
      if (color.degree >= 1) color.rotations.set(k, args_.rotations_out[k] = output(v.size));
    }
    if (this->asset()->skinning == Skinning::linear_stretched) {
      for (std::size_t k = 0; k < 9; ++k) v.axes.set(k, args_.axes_out[k] = output(v.size));
    }
  }

  /// Poses the Gaussians as `actor` is at time t (seconds). An actor that is not in the scene then
  /// leaves an empty set. The Gaussians are there after `backend.synchronize()`, which rendering does.
  /// Errors: invalid_argument for an actor with another asset.
  Status pose(const AvatarActor& actor, double t) {
    if (Status s = place(actor, t); !s || !visible_) return s;
    actor.joint_matrices(t, matrices_);
    return skin();
  }

  /// The same for what these cameras see by `config`: an actor that none of them can see leaves an empty
  /// set and costs its forward kinematics, no more. No pixel of theirs changes by it.
  Status pose(const AvatarActor& actor, double t, std::span<const Camera> cameras,
              const RenderConfig& config) {
    if (Status s = prepare(actor, t, cameras, config); !s) return s;
    return skin_prepared();
  }
  /// That in two steps. The first is the host's alone: several threads may take it, each for another
  /// object.
  Status prepare(const AvatarActor& actor, double t, std::span<const Camera> cameras,
                 const RenderConfig& config) {
    if (Status s = place(actor, t); !s || !visible_) return s;
    actor.joint_globals(t, matrices_);
    const ChunkBounds bounds = bounds_.at(matrices_);
    visible_ = false;
    for (const Camera& c : cameras) {
      visible_ =
          visible_ ||
          may_be_visible(make_projection_camera<double>(c, set_, projection_rules(config)), bounds);
    }
    if (visible_) actor.to_joint_matrices(matrices_);
    return {};
  }
  /// Skins what prepare() found visible. Errors: as of skin().
  Status skin_prepared() { return visible_ ? skin() : Status(); }

  /// The posed Gaussians where the actor stands; empty before the first `pose`. Valid until the next,
  /// while this lives.
  GaussianSet set() const& noexcept {
    GaussianSet s = set_;
    if (!visible_) s.gaussians = {};
    return s;
  }
  GaussianSet set() const&& = delete;

  /// The avatar that it shows.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return arrays_->asset(); }

 private:
  template <Backend>
  friend class SkinnedCrowd;

  /// Where the actor is, and whether it is in the scene.
  Status place(const AvatarActor& actor, double t) {
    if (actor.asset() != asset()) {
      return {Errc::invalid_argument,
              "SkinnedGaussians: the actor has another asset than was given at creation"};
    }
    visible_ = actor.active(t);
    if (visible_) set_.world_from_asset = actor.placement(t);
    return {};
  }
  Status skin() {
    if (asset()->skinning == Skinning::dual_quaternion) {
      set_dual_joints(matrices_);
      return skin_gaussians<float>(*backend_, args_);
    }
    host_joints_.clear();
    for (const auto& m : matrices_) host_joints_.push_back(affine_cast<float>(m));
    joints_.upload(host_joints_.data(), host_joints_.size());
    args_.joints = std::as_const(joints_).view();
    return skin_gaussians<float>(*backend_, args_);
  }
  /// The joint matrices as dual quaternions, to the backend.
  void set_dual_joints(const std::vector<Affine3<double>>& matrices) {
    host_duals_.clear();
    for (const auto& m : matrices) host_duals_.push_back(dual_quat_cast<float>(dual_quat(m)));
    dual_joints_.upload(host_duals_.data(), host_duals_.size());
    args_.dual_joints = std::as_const(dual_joints_).view();
  }
  View<float> output(std::size_t n) {
    floats_.emplace_back(*backend_).resize_discard(n);
    return {floats_.back().data(), n};
  }

  B* backend_;
  std::shared_ptr<const AvatarArrays<B>> arrays_;
  BodyBounds bounds_;
  SkinningArgs<float> args_;
  GaussianSet set_;
  Buffer<Affine3<float>, B> joints_;
  Buffer<DualQuat<float>, B> dual_joints_;  // of these two the one that the asset's skinning reads
  std::vector<Buffer<float, B>> floats_;    // a Buffer's memory stays where it is when the vector grows
  std::vector<Affine3<double>> matrices_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<DualQuat<float>> host_duals_;
  bool visible_ = false;
};

}  // namespace gsnav
