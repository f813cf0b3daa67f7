// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/avatar/smpl_joints.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace gsnav {

const std::array<const char*, 55>& smplx_joint_names() noexcept {
  static constexpr std::array<const char*, 55> kNames{"pelvis",
                                                      "left_hip",
                                                      "right_hip",
                                                      "spine1",
                                                      "left_knee",
                                                      "right_knee",
                                                      "spine2",
                                                      "left_ankle",
                                                      "right_ankle",
                                                      "spine3",
                                                      "left_foot",
                                                      "right_foot",
                                                      "neck",
                                                      "left_collar",
                                                      "right_collar",
                                                      "head",
                                                      "left_shoulder",
                                                      "right_shoulder",
                                                      "left_elbow",
                                                      "right_elbow",
                                                      "left_wrist",
                                                      "right_wrist",
                                                      "jaw",
                                                      "left_eye_smplhf",
                                                      "right_eye_smplhf",
                                                      "left_index1",
                                                      "left_index2",
                                                      "left_index3",
                                                      "left_middle1",
                                                      "left_middle2",
                                                      "left_middle3",
                                                      "left_pinky1",
                                                      "left_pinky2",
                                                      "left_pinky3",
                                                      "left_ring1",
                                                      "left_ring2",
                                                      "left_ring3",
                                                      "left_thumb1",
                                                      "left_thumb2",
                                                      "left_thumb3",
                                                      "right_index1",
                                                      "right_index2",
                                                      "right_index3",
                                                      "right_middle1",
                                                      "right_middle2",
                                                      "right_middle3",
                                                      "right_pinky1",
                                                      "right_pinky2",
                                                      "right_pinky3",
                                                      "right_ring1",
                                                      "right_ring2",
                                                      "right_ring3",
                                                      "right_thumb1",
                                                      "right_thumb2",
                                                      "right_thumb3"};
  return kNames;
}

const std::array<std::int32_t, 55>& smplx_joint_parents() noexcept {
  static constexpr std::array<std::int32_t, 55> kParents{
      -1, 0,  0,  0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  9,  9,  12, 13, 14, 16,
      17, 18, 19, 15, 15, 15, 20, 25, 26, 20, 28, 29, 20, 31, 32, 20, 34, 35, 20,
      37, 38, 21, 40, 41, 21, 43, 44, 21, 46, 47, 21, 49, 50, 21, 52, 53};
  return kParents;
}

const std::array<const char*, 24>& smpl_joint_names() noexcept {
  static constexpr std::array<const char*, 24> kNames{
      "pelvis",     "left_hip",    "right_hip",    "spine1",      "left_knee",     "right_knee",
      "spine2",     "left_ankle",  "right_ankle",  "spine3",      "left_foot",     "right_foot",
      "neck",       "left_collar", "right_collar", "head",        "left_shoulder", "right_shoulder",
      "left_elbow", "right_elbow", "left_wrist",   "right_wrist", "left_hand",     "right_hand"};
  return kNames;
}

const std::array<std::int32_t, 24>& smpl_joint_parents() noexcept {
  static constexpr std::array<std::int32_t, 24> kParents{-1, 0, 0, 0,  1,  2,  3,  4,  5,  6,  7,  8,
                                                         9,  9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21};
  return kParents;
}

BodyJoints body_joints(std::size_t count) noexcept {
  if (count == 24) return {smpl_joint_names(), smpl_joint_parents()};
  if (count == 55) return {smplx_joint_names(), smplx_joint_parents()};
  return {};
}

}  // namespace gsnav
