// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/kernels/fk.hpp"
#include "gsnav/math/mat.hpp"
#include "gsnav/math/quat.hpp"

namespace gsnav {

/// Local transforms of all joints at one time.
struct LocalPose {
  std::vector<Quatd> rotations;     ///< [J] joint to parent, unit; replaces the rest rotation
  std::vector<Vec3d> translations;  ///< [J] joint's place in its parent, metres
  Vec3d root{};                     ///< where the whole avatar has gone in its own frame, metres

  /// invalid_argument naming `what` and the joint: arrays that differ in length, no unit quaternion (1e-4), not finite.
  Status validate(const std::string& what) const {
    const auto bad = [&](const std::string& why) { return Status(Errc::invalid_argument, what + ": " + why); };
    if (rotations.size() != translations.size()) {
      return bad(std::to_string(rotations.size()) + " rotations and " + std::to_string(translations.size()) + " translations");
    }
    for (std::size_t j = 0; j < rotations.size(); ++j) {
      if (!(abs(dot(rotations[j], rotations[j]) - 1.0) < 1e-4)) {
        return bad("the rotation of joint " + std::to_string(j) + " is no unit quaternion");
      }
      if (!is_finite(translations[j])) return bad("the translation of joint " + std::to_string(j) + " is not finite");
    }
    return is_finite(root) ? Status() : bad("root is not finite");
  }
};

/// A tree of joints. Metres; the root frame is the avatar's: Y up, feet on y = 0, facing -Z.
struct Skeleton {
  std::vector<std::string> names;            ///< [J], unique
  std::vector<std::int32_t> parents;         ///< [J], -1 for a root; a parent comes before its children
  std::vector<Affine3<double>> rest_local;   ///< [J] joint to parent in the bind pose, rigid
  /// [J] root frame to joint in the bind pose, rigid. Empty: what rest_local gives.
  std::vector<Affine3<double>> inverse_binds;

  std::size_t size() const noexcept { return parents.size(); }

  /// Index of the joint called `name`, or -1.
  int find(std::string_view name) const noexcept {
    for (std::size_t j = 0; j < names.size(); ++j) {
      if (names[j] == name) return static_cast<int>(j);
    }
    return -1;
  }

  /// Joint to root frame in the bind pose, [J]. Requires a valid skeleton.
  std::vector<Affine3<double>> rest_globals() const {
    std::vector<Affine3<double>> g(size());
    for (std::size_t j = 0; j < size(); ++j) g[j] = joint_global(g.data(), parents[j], rest_local[j]);
    return g;
  }

  /// Root frame to joint in the bind pose, [J].
  std::vector<Affine3<double>> bind_inverses() const {
    if (!inverse_binds.empty()) return inverse_binds;
    std::vector<Affine3<double>> g = rest_globals();
    for (auto& m : g) m = rigid_inverse(m);
    return g;
  }

  LocalPose rest_pose() const {
    LocalPose pose;
    for (const auto& m : rest_local) {
      pose.rotations.push_back(quat_from_matrix(m.linear));
      pose.translations.push_back(m.translation);
    }
    return pose;
  }

  /// invalid_argument, naming the joint, where arrays differ in length, a name is missing or doubled, a
  /// joint is its own ancestor, a parent does not come first, or a transform is not rigid (1e-3).
  Status validate() const {
    const auto bad = [](const std::string& what) { return Status(Errc::invalid_argument, "Skeleton: " + what); };
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

 private:
  static bool rigid(const Affine3<double>& m) noexcept {
    const Mat3d gram = m.linear * transpose(m.linear);
    bool ok = is_finite(m.translation) && determinant(m.linear) > 0;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) ok = ok && abs(gram(i, k) - (i == k ? 1.0 : 0.0)) < 1e-3;
    }
    return ok;
  }
};

/// Joint to root frame, [J], for a pose of this skeleton's size.
inline void forward_kinematics(const Skeleton& skeleton, const LocalPose& pose,
                               std::vector<Affine3<double>>& globals) {
  globals.resize(skeleton.size());
  ForwardKinematicsArgs<double> args;
  args.parents = view_of(skeleton.parents);
  args.rotations = view_of(pose.rotations);
  args.translations = view_of(pose.translations);
  args.globals = view_of(globals);
  ForwardKinematics<double>{args}(0);
}

}  // namespace gsnav
