// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/rigging/joint_match.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/text.hpp"

namespace gsnav {

namespace {

/// A joint's name in lower case, without the prefix "mixamorig:" or "DEF-" and without Sketchfab's
/// suffix "_012".
std::string plain_joint_name(std::string_view name) {
  for (const std::string_view prefix : {"mixamorig:", "DEF-"}) {
    if (name.substr(0, prefix.size()) == prefix) name.remove_prefix(prefix.size());
  }
  const std::size_t bar = name.rfind('_');
  if (bar != name.npos && bar + 1 < name.size() && bar > 0) {
    bool digits = true;
    for (const char c : name.substr(bar + 1))
      digits = digits && std::isdigit(static_cast<unsigned char>(c)) != 0;
    if (digits) name = name.substr(0, bar);
  }
  return lower_case(std::string(name));
}

}  // namespace

const std::array<BodyJointNames, 22>& body_joint_names() noexcept {
  static constexpr std::array<BodyJointNames, 22> kNames{{
      {"pelvis", {"root", "hips", "hip", "Root", nullptr, nullptr}},
      {"spine1", {"lowerback", "spine05", "spine", "Spine1", nullptr, nullptr}},
      {"spine2", {"upperback", "spine03", "Spine2", nullptr, nullptr, nullptr}},
      {"spine3", {"thorax", "spine01", "Spine3", "chest", nullptr, nullptr}},
      {"neck", {"lowerneck", "neck01", "Neck", nullptr, nullptr, nullptr}},
      {"head", {"Head", nullptr, nullptr, nullptr, nullptr, nullptr}},
      {"left_hip", {"lfemur", "upperleg01.L", "UpLeg_L", "LeftUpLeg", "thigh.L", nullptr}},
      {"left_knee", {"ltibia", "lowerleg01.L", "LoLeg_L", "LeftLeg", "shin.L", nullptr}},
      {"left_ankle", {"lfoot", "foot.L", "Foot_L", "LeftFoot", nullptr, nullptr}},
      {"left_foot", {"ltoes", "toe2-1.L", "Toe_L", "LeftToeBase", "toe.L", nullptr}},
      {"right_hip", {"rfemur", "upperleg01.R", "UpLeg_R", "RightUpLeg", "thigh.R", nullptr}},
      {"right_knee", {"rtibia", "lowerleg01.R", "LoLeg_R", "RightLeg", "shin.R", nullptr}},
      {"right_ankle", {"rfoot", "foot.R", "Foot_R", "RightFoot", nullptr, nullptr}},
      {"right_foot", {"rtoes", "toe2-1.R", "Toe_R", "RightToeBase", "toe.R", nullptr}},
      {"left_collar", {"lclavicle", "clavicle.L", "Clavicle_L", "LeftShoulder", nullptr, nullptr}},
      {"left_shoulder", {"lhumerus", "upperarm01.L", "UpArm_L", "LeftArm", "upper_arm.L", nullptr}},
      {"left_elbow", {"lradius", "lowerarm01.L", "LoArm_L", "LeftForeArm", "forearm.L", nullptr}},
      {"left_wrist", {"lwrist", "wrist.L", "Hand_L", "LeftHand", "hand.L", nullptr}},
      {"right_collar", {"rclavicle", "clavicle.R", "Clavicle_R", "RightShoulder", nullptr, nullptr}},
      {"right_shoulder", {"rhumerus", "upperarm01.R", "UpArm_R", "RightArm", "upper_arm.R", nullptr}},
      {"right_elbow", {"rradius", "lowerarm01.R", "LoArm_R", "RightForeArm", "forearm.R", nullptr}},
      {"right_wrist", {"rwrist", "wrist.R", "Hand_R", "RightHand", "hand.R", nullptr}},
  }};
  return kNames;
}

std::array<int, 22> find_body_joints(const Skeleton& skeleton) {
  std::array<int, 22> out;
  out.fill(-1);
  std::vector<std::string> names;
  for (const std::string& n : skeleton.names) names.push_back(plain_joint_name(n));
  const auto find = [&](const char* wanted) {
    const std::string plain = plain_joint_name(wanted);
    for (std::size_t j = 0; j < names.size(); ++j) {
      if (names[j] == plain) return static_cast<int>(j);
    }
    return -1;
  };
  for (std::size_t k = 0; k < out.size(); ++k) {
    const BodyJointNames& n = body_joint_names()[k];
    out[k] = find(n.smpl);
    for (std::size_t i = 0; i < n.others.size() && out[k] < 0 && n.others[i] != nullptr; ++i)
      out[k] = find(n.others[i]);
  }
  return out;
}

Result<double> rest_heading(const Skeleton& skeleton) {
  const auto joints = find_body_joints(skeleton);
  const auto rest = skeleton.rest_globals();
  if (joints[6] < 0 || joints[10] < 0)
    return {Errc::invalid_argument, "rest_heading: there are no hips by any known name"};
  const Vec3d left = rest[static_cast<std::size_t>(joints[6])].translation -
                     rest[static_cast<std::size_t>(joints[10])].translation;
  if (!(std::hypot(left.x, left.z) > 1e-6))
    return {Errc::invalid_argument, "rest_heading: both hips are in one place"};
  return std::atan2(left.z, -left.x);  // left is -X for a body that faces -Z
}

Result<RetargetOptions> match_joints(const Skeleton& source, const Skeleton& target) {
  const auto from = find_body_joints(source), to = find_body_joints(target);
  RetargetOptions out;
  for (std::size_t k = 0; k < from.size(); ++k) {
    if (from[k] < 0 || to[k] < 0) {
      if (k >= 6 && k <= 12 && k != 9) {
        return {Errc::invalid_argument,
                std::string("match_joints: ") + (from[k] < 0 ? "the source" : "the target") +
                    " has no joint that stands for " + body_joint_names()[k].smpl};
      }
      continue;
    }
    const std::string& name = target.names[static_cast<std::size_t>(to[k])];
    out.joints.emplace_back(name, source.names[static_cast<std::size_t>(from[k])]);
    const bool limb = k == 6 || k == 7 || k == 10 || k == 11 || k == 15 || k == 16 || k == 17 ||
                      k == 19 || k == 20 || k == 21;
    if (!limb) out.same_rest.push_back(name);
  }
  if (out.joints.empty() || out.joints[0].first != target.names[0]) {
    out.joints.insert(out.joints.begin(),
                      {target.names[0], from[0] >= 0 ? source.names[static_cast<std::size_t>(from[0])]
                                                     : source.names[0]});
  }
  const auto a = rest_heading(source), b = rest_heading(target);
  if (!a) return a.status();
  if (!b) return b.status();
  out.yaw = *b - *a;
  return out;
}

}  // namespace gsnav
