// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>

#include "gsnav/core/backend.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/kernels/lbs.hpp"

namespace gsnav {

/// Checks that the arrays fit each other; names the one that does not.
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
  const std::size_t rotations = args.rotations_out[0].empty() ? 0 : n;
  for (const auto& v : args.rotations_out) sized(v, rotations, "rotations_out");
  if (status.ok() && n > 0 && args.joints.empty()) {
    status = {Errc::invalid_argument, "SkinningArgs.joints is empty"};
  }
  return status;
}

/// Skins N Gaussians on a backend; a member `skin(const SkinningArgs<S, Out>&)` of it is used where
/// there is one. Every joint index must be below joints.size (AvatarAsset::validate sees to that).
/// The result is there after `backend.synchronize()`. Errors: invalid_argument naming the array.
template <class S, Backend B, class Out>
Status skin_gaussians(B& backend, const SkinningArgs<S, Out>& args) {
  if (Status s = validate(args); !s) return s;
  if constexpr (requires { backend.skin(args); }) {
    backend.skin(args);
  } else {
    backend.parallel_for(args.size(), SkinGaussian<S, Out>{args});
  }
  return {};
}

/// The same for many avatars; a member `skin_all(std::span<const SkinningArgs<S, Out>>)` of the backend is used
/// where there is one (a GPU takes one launch). The bits are those of one avatar at a time. Errors: invalid_argument
/// naming the avatar by its place and the array; nothing is skinned then.
template <class S, Backend B, class Out = float>
Status skin_all(B& backend, std::span<const SkinningArgs<S, Out>> avatars) {
  for (std::size_t i = 0; i < avatars.size(); ++i) {
    if (Status s = validate(avatars[i]); !s) {
      return {s.code(), "avatars[" + std::to_string(i) + "]: " + s.message()};
    }
  }
  if constexpr (requires { backend.skin_all(avatars); }) {
    backend.skin_all(avatars);
  } else {
    for (const SkinningArgs<S, Out>& args : avatars) {
      if (Status s = skin_gaussians<S>(backend, args); !s) return s;
    }
  }
  return {};
}

}  // namespace gsnav
