// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/stages.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/detail/skin/skin_modes.hpp"
#include "gsnav/skin/lbs.hpp"

namespace gsnav {

/// Checks that the lengths of all arrays agree.
/// @return invalid_argument naming the array.
template <class S, class Out>
Status validate(const SkinningArgs<S, Out>& args) {
  const std::size_t n = args.size();
  Status status;
  const auto sized = [&](const auto& view, std::size_t want, const char* name) {
    if (status.ok() && view.size != want) {
      status = {Errc::invalid_argument, std::string("SkinningArgs.") + name + " has " +
                                            std::to_string(view.size) + " values where " +
                                            std::to_string(want) + " are needed"};
    }
  };
  if (args.influences != kInfluences4 && args.influences != kInfluences8) {
    return {Errc::invalid_argument,
            "SkinningArgs.influences is " + std::to_string(args.influences) + "; 4 or 8 are supported"};
  }
  const std::size_t row = static_cast<std::size_t>(args.influences);
  if (n > std::numeric_limits<std::size_t>::max() / row) {
    return {Errc::invalid_argument, "SkinningArgs.means: too many Gaussians"};
  }
  for (const auto& v : args.means) sized(v, n, "means");
  for (const auto& v : args.quats) sized(v, n, "quats");
  sized(args.joint_indices, row * n, "joint_indices");
  sized(args.weights, row * n, "weights");
  for (const auto& v : args.means_out) sized(v, n, "means_out");
  for (const auto& v : args.quats_out) sized(v, n, "quats_out");
  const std::size_t rotations = args.writes_rotations() ? n : 0;
  for (const auto& v : args.rotations_out) sized(v, rotations, "rotations_out");
  if (status.ok() && n > 0 && args.joints.empty() && args.dual_joints.empty()) {
    status = {Errc::invalid_argument, "SkinningArgs.joints is empty"};
  }
  if (!args.weight_gradients.empty()) {
    if (!args.dual_joints.empty()) {
      return {Errc::invalid_argument,
              "SkinningArgs.weight_gradients: stretch goes with linear blending, not with dual_joints"};
    }
    sized(args.weight_gradients, 3 * (row - 1) * n, "weight_gradients");
    for (const auto& v : args.scales) sized(v, n, "scales");
    for (const auto& v : args.axes_out) sized(v, n, "axes_out");
  }
  return status;
}

namespace detail {

/// True if the arrays ask for dual quaternions or stretch instead of plain linear blending.
template <class S, class Out>
bool has_skinning_mode(const SkinningArgs<S, Out>& args) noexcept {
  return !args.dual_joints.empty() || !args.weight_gradients.empty();
}

}  // namespace detail

/// Skins N Gaussians on a backend. The arrays in `args` select the method: linear blending
/// (stage::Skin), dual quaternions, or linear blending with stretch. Every joint index must be less than
/// joints.size, which AvatarAsset::validate checks. The result is complete after
/// `backend.synchronize()`.
/// @return invalid_argument naming the array.
template <class S, Backend B, class Out>
Status skin_gaussians(B& backend, const SkinningArgs<S, Out>& args) {
  if (Status s = validate(args); !s) return s;
  if (!args.dual_joints.empty()) {
    backend.parallel_for(args.size(), SkinGaussianDual<S, Out>{args});
    return {};
  }
  if (!args.weight_gradients.empty()) {
    backend.parallel_for(args.size(), SkinGaussianStretched<S, Out>{args});
    return {};
  }
  run(backend, stage::Skin{}, args);
  return {};
}

/// Skins many avatars, with the same bits as skin_gaussians on each. On a GPU it takes one launch
/// (stage::SkinAll).
/// @return invalid_argument naming the avatar's index and the array; then nothing is skinned.
template <class S, Backend B, class Out = float>
Status skin_all(B& backend, std::span<const SkinningArgs<S, Out>> avatars) {
  for (std::size_t i = 0; i < avatars.size(); ++i) {
    if (Status s = validate(avatars[i]); !s) {
      return {s.code(), "avatars[" + std::to_string(i) + "]: " + s.message()};
    }
  }
  std::size_t modes = 0;
  for (const auto& args : avatars) modes += detail::has_skinning_mode(args) ? 1 : 0;
  if (modes == 0) {
    run(backend, stage::SkinAll{}, avatars);
    return {};
  }
  std::vector<SkinningArgs<S, Out>> linear;
  for (const SkinningArgs<S, Out>& args : avatars) {
    if (!detail::has_skinning_mode(args)) {
      linear.push_back(args);
    } else if (Status s = skin_gaussians<S>(backend, args); !s) {
      return s;
    }
  }
  run(backend, stage::SkinAll{}, std::span<const SkinningArgs<S, Out>>(linear));
  return {};
}

}  // namespace gsnav
