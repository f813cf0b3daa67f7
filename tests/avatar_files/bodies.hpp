// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "support/data.hpp"

namespace gsnav_test {

/// A rigged body of the test data; `ok` is false where its file is not there.
struct TestBody {
  bool ok = false;
  gsnav::io::LoadedSkinnedMesh loaded;
};

inline TestBody gltf_body(const std::string& name) {
  TestBody out;
  const std::string path = data_file("avatars/" + name);
  if (path.empty()) return out;
  out.loaded = gsnav::io::load_gltf_skin(path).value();
  out.ok = true;
  return out;
}

inline TestBody makehuman_body(const std::string& sex) {
  TestBody out;
  const std::string path = data_file("avatars/makehuman_cc0/base.obj");
  if (path.empty()) return out;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  gsnav::io::MakeHumanOptions options;
  options.skeleton = folder / "default.mhskel";
  options.targets = {{folder / ("caucasian-" + sex + "-young.target"), 1.0},
                     {folder / ("universal-" + sex + "-young-averagemuscle-averageweight.target"), 1.0}};
  out.loaded = gsnav::io::load_makehuman(path, options).value();
  out.ok = true;
  return out;
}

/// Joint to root frame, [J], at a time of a clip.
inline std::vector<gsnav::Affine3<double>> joints_at(const gsnav::Skeleton& skeleton,
                                                     const gsnav::LocalPose& pose) {
  std::vector<gsnav::Affine3<double>> out;
  gsnav::forward_kinematics(skeleton, pose, out);
  return out;
}

/// `count` poses over the clip, joint to root frame.
inline std::vector<std::vector<gsnav::Affine3<double>>> poses_of(const gsnav::Skeleton& skeleton,
                                                                 const gsnav::MotionClip& clip,
                                                                 int count) {
  std::vector<std::vector<gsnav::Affine3<double>>> out;
  for (int k = 0; k < count; ++k) {
    gsnav::LocalPose pose;
    clip.pose({clip.duration() * k / count}, pose);
    out.push_back(joints_at(skeleton, pose));
  }
  return out;
}

/// Joint matrices: joint to root frame times inverse bind.
inline std::vector<gsnav::Affine3<double>> times_binds(const gsnav::Skeleton& skeleton,
                                                       std::vector<gsnav::Affine3<double>> joints) {
  const auto binds = skeleton.bind_inverses();
  for (std::size_t j = 0; j < joints.size(); ++j) joints[j] = joints[j] * binds[j];
  return joints;
}

}  // namespace gsnav_test
