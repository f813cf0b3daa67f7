// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "gsnav/config.hpp"
#include "gsnav/core/view.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Transform from a joint's frame to the root frame. `local` maps the joint's frame to the parent's
/// frame, which is the root frame for parent -1. `globals[parent]` must have been computed.
template <class S>
GSNAV_HD Affine3<S> joint_global(const Affine3<S>* globals, std::int32_t parent,
                                 const Affine3<S>& local) noexcept {
  return parent < 0 ? local : globals[static_cast<std::size_t>(parent)] * local;
}

/// The reverse: takes a joint's frame to the frame of its parent. The parent's `globals` are there, and
/// rigid.
template <class S>
GSNAV_HD Affine3<S> joint_local(const Affine3<S>* globals, std::int32_t parent,
                                const Affine3<S>& global) noexcept {
  return parent < 0 ? global : rigid_inverse(globals[static_cast<std::size_t>(parent)]) * global;
}

/// Arrays of forward kinematics for A actors that share a skeleton of J joints. "Global" is the actor's
/// root frame, in metres. A local transform maps a joint's frame to its parent's frame.
template <class S>
struct ForwardKinematicsArgs {
  View<const std::int32_t> parents;  ///< [J], index of the parent, or -1 for a child of the root frame.
                                     ///< Parents come before their children.
  View<const Quat<S>> rotations;     ///< [A][J], local, unit quaternions
  View<const Vec3<S>> translations;  ///< [A][J], local, metres
  View<const Affine3<S>> inverse_binds;  ///< [J]. Empty: joint matrices are not computed.
  View<Affine3<S>> globals;              ///< [A][J], joint frame to root frame
  View<Affine3<S>> joint_matrices;  ///< [A][J], global * inverse bind, which skinning reads. Empty: not
                                    ///< computed.
};

/// Kernel of forward kinematics for pose a: computes global transforms and, if requested, joint matrices
/// from local rotations and offsets.
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
