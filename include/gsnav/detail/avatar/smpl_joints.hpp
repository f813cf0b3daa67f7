// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gsnav {

/// The 55 joint names of SMPL-X, in its order.
const std::array<const char*, 55>& smplx_joint_names() noexcept;

/// Parents of the SMPL-X joints, -1 for the root.
const std::array<std::int32_t, 55>& smplx_joint_parents() noexcept;

/// The 24 joint names of SMPL, in its order. The first 22 are those of SMPL-X.
const std::array<const char*, 24>& smpl_joint_names() noexcept;

/// Parents of the SMPL joints, -1 for the root.
const std::array<std::int32_t, 24>& smpl_joint_parents() noexcept;

/// Names and parents of the joints of a known body model.
struct BodyJoints {
  std::span<const char* const> names;     ///< [J]; empty for an unknown model.
  std::span<const std::int32_t> parents;  ///< [J]
};

/// The joints of the body model that has `count` joints: SMPL for 24, SMPL-X for 55, otherwise none.
BodyJoints body_joints(std::size_t count) noexcept;

}  // namespace gsnav
