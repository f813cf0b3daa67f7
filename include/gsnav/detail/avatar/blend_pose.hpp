// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "gsnav/avatar/skeleton.hpp"

namespace gsnav {

/// Sets the joints of `out` to those between two poses of one skeleton, u in [0, 1]. `out` has their
/// size and may be one of them. Its root is left as it is.
inline void blend_joints(const LocalPose& a, const LocalPose& b, double u, LocalPose& out) {
  for (std::size_t j = 0; j < a.rotations.size(); ++j) {
    out.rotations[j] = slerp(a.rotations[j], b.rotations[j], u);
    out.translations[j] = lerp(a.translations[j], b.translations[j], u);
  }
}

}  // namespace gsnav
