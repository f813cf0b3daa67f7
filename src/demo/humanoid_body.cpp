// SPDX-License-Identifier: Apache-2.0
#include "humanoid_body.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

#include "body_shape.hpp"
#include "gsnav/detail/avatar/smpl_joints.hpp"

namespace gsnav::detail {

HumanoidBuilder::HumanoidBuilder(const HumanoidOptions& o) : options_(o), scale_(o.height / 1.70) {
  place_joints();
  torso();
  head();
  for (const double s : {-1.0, 1.0}) {
    arm(s);
    leg(s);
  }
  for (Lobe& l : shape.lobes) {
    l.a = l.a * scale_;
    l.b = l.b * scale_;
    l.radii_a = l.radii_a * scale_;
    l.radii_b = l.radii_b * scale_;
    l.blend *= scale_;
  }
  shape.enclose();
  for (std::size_t j = 0; j < 55; ++j) {
    const std::int32_t p = skeleton.parents[j];
    skeleton.rest_local[j].translation =
        (at_[j] - (p < 0 ? Vec3d{} : at_[static_cast<std::size_t>(p)])) * scale_;
  }
}

std::uint16_t HumanoidBuilder::joint(const std::string& name) const {
  return static_cast<std::uint16_t>(skeleton.find(name));
}

void HumanoidBuilder::place_joints() {
  for (const char* n : smplx_joint_names()) skeleton.names.emplace_back(n);
  skeleton.parents.assign(smplx_joint_parents().begin(), smplx_joint_parents().end());
  skeleton.rest_local.resize(55);
  const auto put = [&](const std::string& name, const Vec3d& p) { at_[joint(name)] = p; };
  put("pelvis", {0, 0.945, 0.005});
  put("spine1", {0, 1.025, 0.02});
  put("spine2", {0, 1.135, 0.025});
  put("spine3", {0, 1.240, 0.02});
  put("neck", {0, 1.435, 0.02});
  put("head", {0, 1.520, 0.008});
  put("jaw", {0, 1.530, -0.015});
  const double w = options_.shoulders;
  for (const double s : {-1.0, 1.0}) {
    const std::string n = side(s);
    put(n + "hip", {0.088 * s, 0.898, 0.005});
    put(n + "knee", {0.098 * s, 0.485, -0.005});
    put(n + "ankle", {0.104 * s, 0.080, 0.030});
    put(n + "foot", {0.110 * s, 0.022, -0.095});
    put(n + "collar", {0.045 * s, 1.375, 0.012});
    put(n + "shoulder", {0.165 * w * s, 1.385, 0.020});
    put(n + "eye_smplhf", {0.031 * s, 1.588, -0.078});
    const Vec3d d = arm_direction(s), front{0, 0, -1}, under = palm(s);
    const Vec3d elbow = place(n + "shoulder") + d * 0.275 + Vec3d{0, 0, 0.008};
    const Vec3d wrist = elbow + d * 0.245 + Vec3d{0, 0, -0.016};
    put(n + "elbow", elbow);
    put(n + "wrist", wrist);
    const char* fingers[4] = {"index", "middle", "ring", "pinky"};
    const double spread[4] = {0.030, 0.010, -0.011, -0.030}, start[4] = {0.088, 0.091, 0.087, 0.079},
                 bone[4] = {0.030, 0.033, 0.030, 0.024};
    for (std::size_t f = 0; f < 4; ++f) {
      for (int k = 0; k < 3; ++k) {
        put(n + fingers[f] + std::to_string(k + 1),
            wrist + d * (start[f] + (k == 2 ? 1.75 : k) * bone[f]) + front * spread[f]);
      }
    }
    const Vec3d thumb = normalized(d * 0.75 + front * 0.6 + under * 0.25);
    for (int k = 0; k < 3; ++k) {
      put(n + "thumb" + std::to_string(k + 1), wrist + d * 0.025 + front * 0.028 + thumb * (0.031 * k));
    }
  }
}

Lobe& HumanoidBuilder::add(const std::string& name, BodyPart part, const Vec3d& a, const Vec3d& b,
                           const Vec3d& ra, const Vec3d& rb, double blend) {
  shape.lobes.push_back({a, b, ra, rb, Mat3d::identity(), blend, joint(name), part});
  return shape.lobes.back();
}

Lobe& HumanoidBuilder::limb(const std::string& name, BodyPart part, const Vec3d& a, const Vec3d& b,
                            double ra, double rb, double blend) {
  return add(name, part, a, b, {ra, ra, ra}, {rb, rb, rb}, blend);
}

void HumanoidBuilder::torso() {
  const double g = options_.build, w = options_.shoulders;
  const auto r = [g](double x, double y, double z) { return Vec3d{x * g, y, z * g}; };
  add("pelvis", BodyPart::trousers, {0, 0.885, 0.008}, {0, 0.965, 0.008}, r(0.158, 0.085, 0.105),
      r(0.148, 0.09, 0.100), 0.03);
  for (const double s : {-1.0, 1.0}) {
    add("pelvis", BodyPart::trousers, {0.072 * s, 0.880, 0.050}, {0.072 * s, 0.885, 0.050},
        r(0.080, 0.085, 0.075), r(0.080, 0.085, 0.075), 0.04);
  }
  add("spine1", BodyPart::top, {0, 0.985, 0.005}, {0, 1.05, 0.005}, r(0.147, 0.07, 0.102),
      r(0.138, 0.08, 0.098), 0.02);
  add("spine2", BodyPart::top, {0, 1.10, 0.008}, {0, 1.17, 0.010}, {0.137 * g, 0.08, 0.100 * g},
      {0.146 * g * w, 0.08, 0.106 * g}, 0.02);
  add("spine3", BodyPart::top, {0, 1.22, 0.010}, {0, 1.325, 0.015}, {0.150 * g * w, 0.09, 0.110 * g},
      {0.150 * g * w, 0.085, 0.100 * g}, 0.02);
  for (const double s : {-1.0, 1.0}) {
    // Chest, and from the neck down to the shoulder.
    add("spine3", BodyPart::top, {0.065 * s, 1.285, -0.035}, {0.065 * s, 1.290, -0.035},
        r(0.070, 0.065, 0.062), r(0.070, 0.065, 0.062), 0.04);
    limb(side(s) + "collar", BodyPart::top, {0.04 * s, 1.375, 0.018}, {0.150 * w * s, 1.372, 0.020},
         0.062 * g, 0.055 * g, 0.03);
    limb(side(s) + "collar", BodyPart::top, {0.025 * s, 1.435, 0.028}, {0.120 * w * s, 1.398, 0.024},
         0.036, 0.036, 0.03);
  }
}

void HumanoidBuilder::head() {
  const BodyPart skin = BodyPart::skin, hair = BodyPart::hair;
  limb("neck", skin, {0, 1.42, 0.022}, {0, 1.53, 0.010}, 0.056, 0.053, 0.025);
  const auto egg = [&](const Vec3d& c, const Vec3d& r, BodyPart part, double blend) {
    add("head", part, c, c, r, r, blend);
  };
  egg({0, 1.602, 0.000}, {0.074, 0.096, 0.094}, skin, 0.02);    // skull
  egg({0, 1.545, -0.028}, {0.056, 0.066, 0.064}, skin, 0.03);   // lower face
  egg({0, 1.500, -0.062}, {0.026, 0.020, 0.022}, skin, 0.035);  // chin
  egg({0, 1.613, -0.068}, {0.046, 0.016, 0.030}, skin, 0.03);   // brow
  add("head", skin, {0, 1.592, -0.090}, {0, 1.566, -0.103}, {0.009, 0.010, 0.010}, {0.014, 0.011, 0.012},
      0.016);
  egg({0, 1.533, -0.086}, {0.024, 0.012, 0.012}, skin, 0.02);  // mouth
  for (const double s : {-1.0, 1.0}) {
    egg({0.042 * s, 1.566, -0.058}, {0.026, 0.028, 0.026}, skin, 0.03);  // cheeks
    egg({0.075 * s, 1.580, 0.006}, {0.010, 0.030, 0.018}, skin, 0.010);  // ears
  }
  egg({0, 1.618, 0.016}, {0.084, 0.094, 0.098}, hair, 0.006);
  egg({0, 1.575, 0.045}, {0.072, 0.075, 0.065}, hair, 0.02);
  if (options_.long_hair) {
    add("head", hair, {0, 1.60, 0.055}, {0, 1.47, 0.075}, {0.080, 0.05, 0.055}, {0.080, 0.06, 0.036},
        0.03);
  }
}

void HumanoidBuilder::arm(double s) {
  const double g = 0.5 + 0.5 * options_.build;
  const std::string n = side(s);
  const Vec3d shoulder = place(n + "shoulder"), elbow = place(n + "elbow"), wrist = place(n + "wrist");
  const Vec3d d = arm_direction(s), front{0, 0, -1};
  const BodyPart fore = options_.short_sleeves ? BodyPart::skin : BodyPart::top;
  limb(n + "shoulder", BodyPart::top, shoulder, shoulder + d * 0.06, 0.054 * g, 0.052 * g, 0.03);
  limb(n + "shoulder", BodyPart::top, shoulder + d * 0.04, elbow, 0.051 * g, 0.042 * g, 0.008);
  limb(n + "elbow", fore, elbow, lerp(elbow, wrist, 0.35), 0.042 * g, 0.041 * g, 0.008);
  limb(n + "elbow", fore, lerp(elbow, wrist, 0.3),
       lerp(elbow, wrist, fore == BodyPart::top ? 0.93 : 1.0), 0.041 * g,
       (fore == BodyPart::top ? 0.034 : 0.027) * g, 0.006);
  // Palm: wide along front, thin through.
  const Mat3d axes{{front, d, cross(front, d)}};
  add(n + "wrist", BodyPart::skin, wrist, wrist + d * 0.03, {0.027, 0.02, 0.021}, {0.034, 0.02, 0.017},
      0.015)
      .axes = axes;
  add(n + "wrist", BodyPart::skin, wrist + d * 0.04, wrist + d * 0.082, {0.038, 0.02, 0.016},
      {0.041, 0.014, 0.013}, 0.015)
      .axes = axes;
  for (const char* finger : {"index", "middle", "ring", "pinky"}) {
    const double r = std::string(finger) == "pinky" ? 0.0078 : 0.0092;
    const Vec3d one = place(n + finger + "1"), two = place(n + finger + "2"),
                three = place(n + finger + "3");
    limb(n + finger + "1", BodyPart::skin, one, two, r, r, 0.006);
    limb(n + finger + "2", BodyPart::skin, two, three, r, 0.95 * r, 0.004);
    limb(n + finger + "3", BodyPart::skin, three, three + d * 0.016, 0.95 * r, 0.85 * r, 0.004);
  }
  const Vec3d t1 = place(n + "thumb1"), t2 = place(n + "thumb2"), t3 = place(n + "thumb3");
  limb(n + "thumb1", BodyPart::skin, t1, t2, 0.016, 0.012, 0.012);
  limb(n + "thumb2", BodyPart::skin, t2, t3, 0.012, 0.0105, 0.006);
  limb(n + "thumb3", BodyPart::skin, t3, t3 + normalized(t3 - t2) * 0.02, 0.0105, 0.009, 0.004);
}

void HumanoidBuilder::leg(double s) {
  const double g = 0.4 + 0.6 * options_.build;
  const std::string n = side(s);
  const Vec3d hip = place(n + "hip"), knee = place(n + "knee"), ankle = place(n + "ankle");
  const BodyPart cloth = BodyPart::trousers;
  limb(n + "hip", cloth, hip + Vec3d{0, -0.03, 0.002}, lerp(hip, knee, 0.5), 0.084 * g, 0.074 * g, 0.03);
  limb(n + "hip", cloth, lerp(hip, knee, 0.45), knee, 0.075 * g, 0.057 * g, 0.008);
  limb(n + "knee", cloth, knee, lerp(knee, ankle, 0.3), 0.056 * g, 0.054 * g, 0.008);
  limb(n + "knee", cloth, lerp(knee, ankle, 0.25) + Vec3d{0, 0, 0.012},
       lerp(knee, ankle, 0.55) + Vec3d{0, 0, 0.008}, 0.054 * g, 0.050 * g, 0.012);
  limb(n + "knee", cloth, lerp(knee, ankle, 0.5), lerp(knee, ankle, 0.86), 0.050 * g, 0.047 * g, 0.008);
  const BodyPart shoe = BodyPart::shoes;
  const double x = ankle.x, out = 0.006 * s;
  limb(n + "ankle", shoe, {x, 0.060, 0.032}, {x, 0.105, 0.030}, 0.037, 0.036, 0.01);
  add(n + "ankle", shoe, {x, 0.026, 0.050}, {x, 0.026, 0.050}, {0.036, 0.042, 0.042},
      {0.036, 0.042, 0.042}, 0.02);
  Lobe& mid = add(n + "ankle", shoe, {x, 0.034, 0.035}, {x + out, 0.022, -0.085}, {0.036, 0.04, 0.050},
                  {0.043, 0.04, 0.038}, 0.02);
  mid.axes = {{{1, 0, 0}, {0, 0, 1}, {0, 1, 0}}};
  add(n + "foot", shoe, {x + out, 0.018, -0.100}, {x + out, 0.016, -0.125}, {0.043, 0.034, 0.040},
      {0.038, 0.028, 0.050}, 0.02);
}

}  // namespace gsnav::detail
