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

/// The arrays of an asset in a backend's memory, shared by all its actors. On host backends they are the
/// asset's own; other backends get a copy. The backend must outlive this object.
template <Backend B>
class AvatarArrays {
 public:
  /// Uploads the asset's arrays where the backend has a memory of its own.
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

  /// The asset.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return asset_; }
  /// The canonical Gaussians. Valid while this object lives.
  const GaussianSet& set() const& noexcept { return set_; }
  /// Deleted: the reference would point into a temporary.
  const GaussianSet& set() const&& = delete;
  /// Arguments of skin_gaussians, without joints and outputs. Valid while this object lives.
  const SkinningArgs<float>& skinning() const& noexcept { return args_; }
  /// Deleted: the reference would point into a temporary.
  const SkinningArgs<float>& skinning() const&& = delete;

 private:
  std::shared_ptr<const AvatarAsset> asset_;
  GaussianSet set_;
  SkinningArgs<float> args_;
  std::vector<Buffer<std::uint16_t, B>> shorts_;
  std::vector<Buffer<float, B>> floats_;
};

/// The Gaussians of one actor, posed on a backend, to be rendered together with the scene. Only means
/// and orientations are written in each frame, into buffers that are reused. SH of degree 1 and more
/// also needs the rotations that turn view directions back, and stretched skinning the shapes. All else
/// stays in the asset's arrays, which other backends than host backends upload once. The backend must
/// outlive this object.
///
///     SkinnedGaussians skin(backend, actor.asset());
///     skin.pose(actor, t).throw_if_error();
///     renderer.render({{cloud.set(), skin.set()}}, cameras);
template <Backend B>
class SkinnedGaussians {
 public:
  /// Allocates the buffers for `asset` and uploads its arrays.
  SkinnedGaussians(B& backend, std::shared_ptr<const AvatarAsset> asset)
      : SkinnedGaussians(backend, std::make_shared<const AvatarArrays<B>>(backend, std::move(asset))) {}
  /// Allocates the buffers for an asset whose arrays are shared with other actors.
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

  /// Poses the Gaussians for time t (seconds on the scene's clock). If the actor is not in the scene
  /// then, the set is empty. The Gaussians are complete after `backend.synchronize()`, which rendering
  /// calls. Error: invalid_argument for an actor of another asset.
  Status pose(const AvatarActor& actor, double t) {
    if (Status s = place(actor, t); !s || !visible_) return s;
    actor.joint_matrices(t, matrices_);
    return skin();
  }

  /// Poses the Gaussians for rendering with `config` from these cameras. If none of them can see the
  /// actor, the set is empty, which costs only its forward kinematics and changes no pixel. Errors: as
  /// above.
  Status pose(const AvatarActor& actor, double t, std::span<const Camera> cameras,
              const RenderConfig& config) {
    if (Status s = prepare(actor, t, cameras, config); !s) return s;
    return skin_prepared();
  }
  /// First of the two steps of `pose`: forward kinematics and culling, on the host. Several threads may
  /// prepare different objects at once.
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
  /// Second step of `pose`: skins the Gaussians, unless no camera sees them.
  Status skin_prepared() { return visible_ ? skin() : Status(); }

  /// The posed Gaussians, placed in the world. Empty before the first `pose`. Valid until the next one
  /// and while this object lives.
  GaussianSet set() const& noexcept {
    GaussianSet s = set_;
    if (!visible_) s.gaussians = {};
    return s;
  }
  /// Deleted: the set would point into a temporary.
  GaussianSet set() const&& = delete;

  /// The asset.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept { return arrays_->asset(); }

 private:
  template <Backend>
  friend class SkinnedCrowd;

  /// Sets the placement, and whether the actor is in the scene at time t.
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
  /// Uploads the joint matrices as dual quaternions.
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
  Buffer<DualQuat<float>, B> dual_joints_;  // whichever of these two the asset's skinning reads
  std::vector<Buffer<float, B>> floats_;    // a Buffer's memory does not move when the vector grows
  std::vector<Affine3<double>> matrices_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<DualQuat<float>> host_duals_;
  bool visible_ = false;
};

}  // namespace gsnav
