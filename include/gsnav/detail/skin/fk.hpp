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

/// Reverse of joint_global: the transform from a joint's frame to its parent's frame, where `global`
/// maps the joint's frame to the root frame. `globals[parent]` must have been computed and be rigid.
template <class S>
GSNAV_HD Affine3<S> joint_local(const Affine3<S>* globals, std::int32_t parent,
                                const Affine3<S>& global) noexcept {
  return parent < 0 ? global : rigid_inverse(globals[static_cast<std::size_t>(parent)]) * global;
}

/// Forward kinematics of a skeleton of J joints: fills `globals` with the transforms from joints to the
/// root frame, metres.
/// @param parents [J], index of the parent, or -1 for a child of the root frame. Parents come before
///   their children.
/// @param rotations,translations [J], local: unit quaternions, and metres in the parent's frame.
/// @param needed [J], 0 for joints to leave out. Empty: all joints are computed.
template <class S>
GSNAV_HD void forward_kinematics(View<const std::int32_t> parents, View<const Quat<S>> rotations,
                                 View<const Vec3<S>> translations, View<Affine3<S>> globals,
                                 View<const char> needed = {}) noexcept {
  for (std::size_t j = 0; j < parents.size; ++j) {
    if (!needed.empty() && needed[j] == 0) continue;
    const Affine3<S> local{rotation_matrix(rotations[j]), translations[j]};
    globals[j] = joint_global(globals.data, parents[j], local);
  }
}

}  // namespace gsnav
