// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "body_shape.hpp"
#include "gsnav/avatar/skeleton.hpp"
#include "gsnav/detail/demo/humanoid.hpp"

namespace gsnav::detail {

/// Joints and surface of the procedural person in its bind pose: Y up, facing -Z, the right side at +X,
/// arms 50 degrees below the horizontal. Dimensions are for 1.70 m and scaled.
class HumanoidBuilder {
 public:
  explicit HumanoidBuilder(const HumanoidOptions& o);

  Skeleton skeleton;
  BodyShape shape;

 private:
  std::uint16_t joint(const std::string& name) const;
  static std::string side(double s) { return s < 0 ? "left_" : "right_"; }
  Vec3d place(const std::string& name) const { return at_[joint(name)]; }

  void place_joints();

  static Vec3d arm_direction(double s) noexcept { return {0.6427876 * s, -0.7660444, 0}; }
  static Vec3d palm(double s) noexcept { return {-0.7660444 * s, -0.6427876, 0}; }

  Lobe& add(const std::string& name, BodyPart part, const Vec3d& a, const Vec3d& b, const Vec3d& ra,
            const Vec3d& rb, double blend);
  // A round limb between two points; its ends have the radius of the limb.
  Lobe& limb(const std::string& name, BodyPart part, const Vec3d& a, const Vec3d& b, double ra,
             double rb, double blend);

  void torso();

  void head();

  void arm(double s);

  void leg(double s);

  HumanoidOptions options_;
  double scale_;
  std::array<Vec3d, 55> at_{};
};

}  // namespace gsnav::detail
