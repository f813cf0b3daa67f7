// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav::io::detail {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// A bone of an Acclaim skeleton.
struct AsfBone {
  std::string name;
  Vec3d direction{};
  double length = 0.0;     ///< Length of the bone, in units of the file.
  Quatd axis{};            ///< C, the rotation of the bone's own axes.
  std::vector<int> turns;  ///< Axes of its rotations in the order listed: 0 x, 1 y, 2 z.
  std::vector<std::size_t> children;
};

/// An Acclaim skeleton as in its file. Bone 0 is the root.
struct AsfSkeleton {
  std::vector<AsfBone> bones{{"root", {}, 0.0, {}, {}, {}}};
  std::vector<std::pair<bool, int>> root_order;  ///< (is a rotation, axis).
  Vec3d root_position{}, root_angles{};
  double length_unit = 1.0, angle_unit = kRadiansPerDegree;

  /// Index of the bone called `name`, or bones.size().
  std::size_t find(std::string_view name) const;
};

/// The rotation by `angle` (radians) about axis 0, 1 or 2.
Quatd about_axis(int axis, double angle);

/// Reads the text of an ASF file. Errors name the line: invalid_file; unsupported (a bone with a degree
/// of freedom that is not a rotation).
Result<AsfSkeleton> read_asf(std::string_view text, const std::string& source);

/// Makes a skeleton from the bones below the root, parents first. `joints[b]` is the joint of bone b.
Status asf_joints(const AsfSkeleton& file, double scale, const std::string& source, Skeleton& out,
                  std::vector<std::size_t>& joints);

}  // namespace gsnav::io::detail
