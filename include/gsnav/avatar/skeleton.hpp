// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// A tree of joints. Parents come before their children; metres.
struct Skeleton {
  std::vector<std::string> names;
  std::vector<int> parents;           ///< -1 for the root, which is joint 0
  std::vector<Vec3d> rest_positions;  ///< in the avatar's frame; rest rotations are identities

  std::size_t joint_count() const noexcept { return parents.size(); }
};

/// invalid_argument, naming the joint, where the tree is none.
inline Status validate(const Skeleton& s) {
  const auto bad = [](const std::string& what) { return Status(Errc::invalid_argument, "Skeleton: " + what); };
  if (s.parents.empty()) return bad("no joints");
  if (s.names.size() != s.parents.size() || s.rest_positions.size() != s.parents.size()) {
    return bad("names, parents and rest_positions have different lengths");
  }
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    const bool root = j == 0 && s.parents[j] == -1;
    if (!root && (s.parents[j] < 0 || static_cast<std::size_t>(s.parents[j]) >= j)) {
      return bad("joint " + std::to_string(j) + " (" + s.names[j] + ") has parent " +
                 std::to_string(s.parents[j]) + "; a parent must come before its child");
    }
    if (!is_finite(s.rest_positions[j])) {
      return bad("joint " + std::to_string(j) + " (" + s.names[j] + ") has a position that is not finite");
    }
  }
  return {};
}

}  // namespace gsnav
