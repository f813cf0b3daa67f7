// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gsnav/detail/io/motion_file.hpp"

namespace gsnav_test {

/// Joints to the world, metres, where a motion is after `time` seconds.
inline std::vector<gsnav::Affine3<double>> pose_at(const gsnav::io::LoadedMotion& m, double time) {
  gsnav::LocalPose pose;
  m.clip.pose({time}, pose);
  std::vector<gsnav::Affine3<double>> globals;
  gsnav::forward_kinematics(m.skeleton, pose, globals);
  for (auto& g : globals) g.translation += pose.root;
  return globals;
}

}  // namespace gsnav_test
