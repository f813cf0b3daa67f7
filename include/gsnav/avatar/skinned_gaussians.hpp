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
  /// @param with_levels whether its levels of detail are wanted too.
  AvatarArrays(B& backend, std::shared_ptr<const AvatarAsset> asset, bool with_levels = false)
      : asset_(std::move(asset)) {
    for (std::size_t l = 0; with_levels && l < asset_->levels.size(); ++l)
      levels_.push_back(std::make_shared<const AvatarArrays>(backend, asset_->levels[l].body));
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
  /// Arrays of its levels of detail, from the finest one. Empty if they are not wanted.
  const std::vector<std::shared_ptr<const AvatarArrays>>& levels() const noexcept { return levels_; }
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
  std::vector<std::shared_ptr<const AvatarArrays>> levels_;
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
        bounds_(*arrays->asset(), !arrays->levels().empty()),
        joints_(backend),
        dual_joints_(backend),
        levels_(1 + arrays->levels().size()) {
    levels_[0].emplace(backend, std::move(arrays));
  }

  /// Poses the Gaussians for time t (seconds on the scene's clock). If the actor is not in the scene
  /// then, the set is empty. The Gaussians are complete after `backend.synchronize()`, which rendering
  /// calls. Error: invalid_argument for an actor of another asset.
  Status pose(const AvatarActor& actor, double t) {
    if (Status s = prepare_levels(actor, t, [](const auto&, const auto&) { return 1u; }); !s) return s;
    return skin_prepared();
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
    return prepare_levels(actor, t, [&](const GaussianSet& set, const ChunkBounds& bounds) {
      std::uint32_t seen = 0;
      for (const Camera& c : cameras) seen = seen != 0 || is_seen(c, config, set, bounds) ? 1 : 0;
      return seen;
    });
  }
  /// Second step of `pose`: skins the Gaussians, unless no camera sees them.
  Status skin_prepared() { return wanted_ != 0 ? skin() : Status(); }

  /// The posed Gaussians, placed in the world. Empty before the first `pose`. Valid until the next one
  /// and while this object lives.
  GaussianSet set() const& noexcept { return set_of(0); }
  /// Deleted: the set would point into a temporary.
  GaussianSet set() const&& = delete;

  /// The asset.
  const std::shared_ptr<const AvatarAsset>& asset() const noexcept {
    return levels_[0]->arrays->asset();
  }

  /// Whether a camera that renders with `config` may see Gaussians of a set within `bounds`.
  static bool is_seen(const Camera& camera, const RenderConfig& config, const GaussianSet& set,
                      const ChunkBounds& bounds) {
    return may_be_visible(make_projection_camera<double>(camera, set, projection_rules(config)), bounds);
  }

 private:
  template <Backend>
  friend class SkinnedCrowd;

  /// The whole body, or a level of detail, and the arrays of its posed Gaussians.
  struct Level {
    Level(B& backend, std::shared_ptr<const AvatarArrays<B>> its)
        : arrays(std::move(its)), args(arrays->skinning()), set(arrays->set()), floats(backend) {
      ShapeRows& v = set.gaussians.shape;
      ColorRows& color = set.gaussians.color;
      const bool turns = color.degree >= 1,
                 stretches = arrays->asset()->skinning == Skinning::linear_stretched;
      // One block, because a batch has thousands of these. Each array begins at a multiple of 256 bytes.
      const std::size_t stride = (v.size + 63) / 64 * 64;
      floats.resize_exactly(stride * (7 + (turns ? 4 : 0) + (stretches ? 9 : 0)));
      float* next = floats.data();
      const auto output = [&] {
        const View<float> array{next, v.size};
        next += v.size == 0 ? 0 : stride;
        return array;
      };
      for (std::size_t k = 0; k < 3; ++k) v.means.set(k, args.means_out[k] = output());
      for (std::size_t k = 0; k < 4; ++k) {
        v.quats.set(k, args.quats_out[k] = output());
        if (turns) color.rotations.set(k, args.rotations_out[k] = output());
      }
      for (std::size_t k = 0; stretches && k < 9; ++k) v.axes.set(k, args.axes_out[k] = output());
    }
    std::shared_ptr<const AvatarArrays<B>> arrays;
    SkinningArgs<float> args;
    GaussianSet set;
    Buffer<float, B> floats;  // Its memory does not move when the level does.
  };

  /// The Gaussians of a level, placed in the world. Empty if that level was not posed.
  GaussianSet set_of(std::size_t level) const noexcept {
    const bool posed = (wanted_ >> level & 1) != 0 && levels_[level];
    GaussianSet s = posed ? levels_[level]->set : levels_[0]->set;
    s.world_from_asset = world_;
    if (!posed) s.gaussians = {};
    return s;
  }
  /// Forward kinematics, on the host. wanted(set, bounds) returns a bit for each level that is to be
  /// skinned, that of the whole body first.
  template <class Wanted>
  Status prepare_levels(const AvatarActor& actor, double t, const Wanted& wanted) {
    if (Status s = present(actor, t); !s || wanted_ == 0) return s;
    if (const auto rough = actor.joint_ball(t)) {
      world_ = rough->placement;
      wanted_ = wanted(set_of(0), bounds_.around(rough->joints.center, rough->joints.radius));
      if (wanted_ == 0) return {};
    }
    world_ = actor.joint_globals(t, matrices_);
    bounds_now_ = bounds_.at(matrices_);
    wanted_ = wanted(set_of(0), bounds_now_);
    if (wanted_ == 0) return {};
    actor.to_joint_matrices(matrices_);
    host_joints_.clear();
    for (const auto& m : matrices_) host_joints_.push_back(affine_cast<float>(m));
    return {};
  }
  /// Calls f with the arguments of each level that is to be skinned. Allocates its arrays first.
  template <class F>
  void for_each_wanted(const F& f) {
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      if ((wanted_ >> l & 1) == 0) continue;
      if (!levels_[l]) levels_[l].emplace(*backend_, levels_[0]->arrays->levels()[l - 1]);
      f(levels_[l]->args);
    }
  }

  /// Sets whether the actor is in the scene at time t. Only the whole body is wanted then.
  Status present(const AvatarActor& actor, double t) {
    if (actor.asset() != asset()) {
      return {Errc::invalid_argument,
              "SkinnedGaussians: the actor has another asset than was given at creation"};
    }
    wanted_ = actor.active(t) ? 1 : 0;
    return {};
  }
  Status skin() {
    SkinningArgs<float>& args = levels_[0]->args;
    if (asset()->skinning == Skinning::dual_quaternion) {
      set_dual_joints(matrices_);
      return skin_gaussians<float>(*backend_, args);
    }
    joints_.upload(host_joints_.data(), host_joints_.size());
    args.joints = std::as_const(joints_).view();
    return skin_gaussians<float>(*backend_, args);
  }
  /// Uploads the joint matrices as dual quaternions.
  void set_dual_joints(const std::vector<Affine3<double>>& matrices) {
    host_duals_.clear();
    for (const auto& m : matrices) host_duals_.push_back(dual_quat_cast<float>(dual_quat(m)));
    dual_joints_.upload(host_duals_.data(), host_duals_.size());
    for (auto& level : levels_) {
      if (level) level->args.dual_joints = std::as_const(dual_joints_).view();
    }
  }

  B* backend_;
  BodyBounds bounds_;
  Similarity world_;        // Placement of the actor.
  ChunkBounds bounds_now_;  // In the present pose.
  Buffer<Affine3<float>, B> joints_;
  Buffer<DualQuat<float>, B> dual_joints_;    // whichever of these two the asset's skinning reads
  std::vector<std::optional<Level>> levels_;  // The whole body, then the levels that were needed so far.
  std::vector<Affine3<double>> matrices_;
  std::vector<Affine3<float>> host_joints_;
  std::vector<DualQuat<float>> host_duals_;
  std::uint32_t wanted_ = 0;  // Bits of the levels that are posed. 0: the actor is not seen.
};

}  // namespace gsnav
