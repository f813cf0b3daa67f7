// SPDX-License-Identifier: Apache-2.0
#include "gsnav/avatar/skeleton.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/detail/skin/fk.hpp"

namespace gsnav {

namespace {

bool rigid(const Affine3<double>& m) noexcept {
  return is_finite(m.translation) && determinant(m.linear) > 0 &&
         distance_from_orthogonal(m.linear) < 1e-3;
}

}  // namespace

Status LocalPose::validate(const std::string& what) const {
  const auto bad = [&](const std::string& why) {
    return Status(Errc::invalid_argument, what + ": " + why);
  };
  if (rotations.size() != translations.size()) {
    return bad(std::to_string(rotations.size()) + " rotations and " +
               std::to_string(translations.size()) + " translations");
  }
  for (std::size_t j = 0; j < rotations.size(); ++j) {
    if (!(abs(dot(rotations[j], rotations[j]) - 1.0) < 1e-4)) {
      return bad("the rotation of joint " + std::to_string(j) + " is no unit quaternion");
    }
    if (!is_finite(translations[j]))
      return bad("the translation of joint " + std::to_string(j) + " is not finite");
  }
  return is_finite(root) ? Status() : bad("root is not finite");
}

int Skeleton::find(std::string_view name) const noexcept {
  for (std::size_t j = 0; j < names.size(); ++j) {
    if (names[j] == name) return static_cast<int>(j);
  }
  return -1;
}

std::vector<Affine3<double>> Skeleton::rest_globals() const {
  std::vector<Affine3<double>> g(size());
  for (std::size_t j = 0; j < size(); ++j) g[j] = joint_global(g.data(), parents[j], rest_local[j]);
  return g;
}

std::vector<Affine3<double>> Skeleton::bind_inverses() const {
  if (!inverse_binds.empty()) return inverse_binds;
  std::vector<Affine3<double>> g = rest_globals();
  for (auto& m : g) m = rigid_inverse(m);
  return g;
}

LocalPose Skeleton::rest_pose() const {
  LocalPose pose;
  for (const auto& m : rest_local) {
    pose.rotations.push_back(quat_from_matrix(m.linear));
    pose.translations.push_back(m.translation);
  }
  return pose;
}

Status Skeleton::validate() const {
  const BadArgument bad{"Skeleton: "};
  const std::size_t n = parents.size();
  if (n == 0) return bad("no joints");
  const auto sized = [&](std::size_t have, const char* name) {
    return have == n ? Status()
                     : bad(std::string(name) + " has " + std::to_string(have) + " entries for " +
                           std::to_string(n) + " joints");
  };
  if (Status s = sized(names.size(), "names"); !s) return s;
  if (Status s = sized(rest_local.size(), "rest_local"); !s) return s;
  if (!inverse_binds.empty()) {
    if (Status s = sized(inverse_binds.size(), "inverse_binds"); !s) return s;
  }
  for (std::size_t j = 0; j < n; ++j) {
    const std::string who = "joint " + std::to_string(j) + " (\"" + names[j] + "\") ";
    if (names[j].empty()) return bad("joint " + std::to_string(j) + " has no name");
    if (find(names[j]) != static_cast<int>(j)) return bad(who + "has the name of another joint");
    const std::int32_t parent = parents[j];
    if (parent < -1 || parent >= static_cast<std::int32_t>(n)) {
      return bad(who + "has parent " + std::to_string(parent) + " of " + std::to_string(n));
    }
    if (parent >= static_cast<std::int32_t>(j)) {
      std::int32_t up = parent;
      for (std::size_t k = 0; k < n && up >= 0 && up != static_cast<std::int32_t>(j); ++k) {
        up = parents[static_cast<std::size_t>(up)];
        if (up >= static_cast<std::int32_t>(n)) break;
      }
      return bad(who + (up == static_cast<std::int32_t>(j)
                            ? std::string("is its own ancestor")
                            : "comes before its parent " + std::to_string(parent)));
    }
    if (!rigid(rest_local[j])) return bad(who + "has a rest transform that is not rigid");
    if (!inverse_binds.empty() && !rigid(inverse_binds[j])) {
      return bad(who + "has an inverse bind that is not rigid");
    }
  }
  return {};
}

void forward_kinematics(const Skeleton& skeleton, const LocalPose& pose,
                        std::vector<Affine3<double>>& globals, const std::vector<char>& needed) {
  globals.resize(skeleton.size());
  forward_kinematics<double>(view_of(skeleton.parents), view_of(pose.rotations),
                             view_of(pose.translations), view_of(globals), view_of(needed));
}

void to_joint_matrices(std::vector<Affine3<double>>& globals,
                       const std::vector<Affine3<double>>& bind_inverses) noexcept {
  for (std::size_t j = 0; j < globals.size(); ++j) globals[j] = globals[j] * bind_inverses[j];
}

}  // namespace gsnav
