// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/config.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// A joint's frame to the root frame, from its frame to its parent's; `parent` -1: that is the root
/// frame. The parent's `globals` are there.
template <class S>
GSNAV_HD Affine3<S> joint_global(const Affine3<S>* globals, std::int32_t parent,
                                 const Affine3<S>& local) noexcept {
  return parent < 0 ? local : globals[static_cast<std::size_t>(parent)] * local;
}

/// One actor's pose in a batch of actors that share a skeleton of J joints, A poses in all. Frames:
/// global is the actor's root frame, metres; a local transform maps a joint's frame to its parent's.
template <class S>
struct ForwardKinematicsArgs {
  View<const std::int32_t> parents;      ///< [J], -1: child of the root frame; a parent comes first
  View<const Quat<S>> rotations;         ///< [A][J] local, unit
  View<const Vec3<S>> translations;      ///< [A][J] local, metres
  View<const Affine3<S>> inverse_binds;  ///< [J], or empty: no joint matrices
  View<Affine3<S>> globals;              ///< [A][J] joint frame to root frame
  View<Affine3<S>> joint_matrices;       ///< [A][J] global * inverse bind, or empty
};

/// Forward kinematics of pose a: from local rotations and offsets to global transforms and, where they
/// are asked for, the joint matrices that skinning reads.
template <class S>
struct ForwardKinematics {
  ForwardKinematicsArgs<S> args;

  GSNAV_HD void operator()(std::size_t a) const noexcept {
    const std::size_t count = args.parents.size, base = a * count;
    for (std::size_t j = 0; j < count; ++j) {
      const Affine3<S> local{rotation_matrix(args.rotations[base + j]), args.translations[base + j]};
      args.globals[base + j] = joint_global(args.globals.data + base, args.parents[j], local);
    }
    if (args.joint_matrices.empty()) return;
    for (std::size_t j = 0; j < count; ++j) {
      args.joint_matrices[base + j] = args.globals[base + j] * args.inverse_binds[j];
    }
  }
};

}  // namespace gsnav
