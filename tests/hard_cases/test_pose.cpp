// SPDX-License-Identifier: Apache-2.0
// N60: poses between keys and forward kinematics.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "gsnav/avatar/motion.hpp"
#include "gsnav/detail/skin/fk.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("N60_slerp_vs_lerp") {
  // Two keys of a chain of four joints of 0.25 m; poses between them by slerp of local rotations.
  Rng rng(60);
  const std::size_t joints = 4;
  for (const double degrees : {10.0, 30.0, 60.0}) {
    CAPTURE(degrees);
    double worst_float = 0, worst_double = 0, matrix_lerp = 0;
    for (int round = 0; round < 200; ++round) {
      Skeleton skeleton;
      MotionClip clip;
      clip.frame_rate = 1;
      clip.joints = joints;
      clip.end = ClipEnd::hold;
      std::vector<Quatd> keys[2];
      std::vector<Vec3d> axes;
      for (std::size_t j = 0; j < joints; ++j) {
        skeleton.names.push_back("joint" + std::to_string(j));
        skeleton.parents.push_back(static_cast<std::int32_t>(j) - 1);
        skeleton.rest_local.emplace_back();
        skeleton.rest_local.back().translation = {0, j == 0 ? 1.0 : 0.25, 0};
        axes.push_back(normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()}));
        keys[0].push_back(random_rotation(rng));
        // Either sign stands for the same rotation: the short way must be taken.
        const Quatd next = keys[0][j] * axis_angle(axes[j], degrees * 0.017453292519943295);
        keys[1].push_back(rng.below(2) == 0 ? next : -next);
      }
      for (const auto& key : keys) clip.rotations.insert(clip.rotations.end(), key.begin(), key.end());
      clip.translations = skeleton.rest_pose().translations;
      REQUIRE(clip.validate().ok());
      for (const double u : {0.25, 0.5, 0.75}) {
        // Truth: each joint has turned by u of its angle about its axis, by Rodrigues' formula.
        Real global[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, at[3] = {0, 0, 0};
        for (std::size_t j = 0; j < joints; ++j) {
          const Vec3d& offset = skeleton.rest_local[j].translation;
          for (int r = 0; r < 3; ++r) at[r] += global[r][1] * static_cast<Real>(offset.y);
          const Mat3d first = rotation_matrix(keys[0][j]);
          const Real angle = static_cast<Real>(u * degrees) * 0.017453292519943295769L;
          const Real s = std::sin(angle), c = std::cos(angle), n[3] = {axes[j].x, axes[j].y, axes[j].z};
          const Real cross_axis[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
          Real turn[3][3], local[3][3], next[3][3];
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k)
              turn[r][k] = (r == k ? c : 0) + s * cross_axis[r][k] + (1 - c) * n[r] * n[k];
          }
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) {
              local[r][k] = 0;
              for (int i = 0; i < 3; ++i) local[r][k] += static_cast<Real>(first(r, i)) * turn[i][k];
            }
          }
          for (int r = 0; r < 3; ++r) {
            for (int k = 0; k < 3; ++k) {
              next[r][k] = 0;
              for (int i = 0; i < 3; ++i) next[r][k] += global[r][i] * local[i][k];
            }
          }
          std::copy(&next[0][0], &next[0][0] + 9, &global[0][0]);
        }
        for (int r = 0; r < 3; ++r) at[r] += global[r][1] * 0.5L;  // half a metre along the last joint

        MotionInput input;
        input.time = u;
        LocalPose pose;
        clip.pose(input, pose);
        std::vector<Affine3<double>> globals;
        forward_kinematics(skeleton, pose, globals);
        const Vec3d seen = globals.back() * Vec3d{0, 0.5, 0};
        // The kernel in float, as a device would run it.
        std::vector<Quatf> rotations;
        std::vector<Vec3f> translations;
        for (std::size_t j = 0; j < joints; ++j) {
          rotations.push_back(quat_cast<float>(pose.rotations[j]));
          translations.push_back(vec_cast<float>(pose.translations[j]));
        }
        std::vector<Affine3<float>> globals_f(joints);
        forward_kinematics<float>(view_of(skeleton.parents), view_of(std::as_const(rotations)),
                                  view_of(std::as_const(translations)), view_of(globals_f));
        const Vec3d seen_f = vec_cast<double>(globals_f.back() * Vec3f{0, 0.5f, 0});
        // What mixing the keys' matrices would give, for one joint half a metre long.
        const Mat3d a = rotation_matrix(keys[0][0]), b = rotation_matrix(keys[1][0]);
        const Mat3d mixed = a * (1 - u) + b * u, right = rotation_matrix(pose.rotations[0]);
        const Vec3d arm = normalized(cross(axes[0], Vec3d{0.3, 0.5, 0.8})) * 0.5;
        matrix_lerp = std::max(matrix_lerp, norm(mixed * arm - right * arm));
        for (int r = 0; r < 3; ++r) {
          worst_double =
              std::max(worst_double, static_cast<double>(std::abs(at[r] - static_cast<Real>(seen[r]))));
          worst_float =
              std::max(worst_float, static_cast<double>(std::abs(at[r] - static_cast<Real>(seen_f[r]))));
        }
      }
    }
    MESSAGE(degrees << " degrees a key: slerp and forward kinematics " << 1e3 * worst_float
                    << " mm in float, " << 1e3 * worst_double << " in double; matrices mixed "
                    << 1e3 * matrix_lerp << " mm");
    CHECK(worst_double < 1e-12);
    CHECK(worst_float < 5e-6);  // the budget is 0.05 mm
    CHECK(matrix_lerp > 1e-3);
  }
}
