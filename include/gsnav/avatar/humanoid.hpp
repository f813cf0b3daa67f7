// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "gsnav/avatar/actor.hpp"
#include "gsnav/avatar/humanoid_rig.hpp"
#include "gsnav/core/rng.hpp"

namespace gsnav {

/// What a procedural person is made of.
struct HumanoidOptions {
  double height = 1.70;  ///< metres, in [1, 2.3]
  int gaussians = 30000;
  std::uint64_t seed = 1;
  Vec3d shirt{0.20, 0.40, 0.62}, trousers{0.18, 0.19, 0.24}, skin{0.80, 0.60, 0.49}, hair{0.17, 0.11, 0.08},
      shoes{0.12, 0.10, 0.10};  ///< display-referred colours
};

namespace detail {

/// A tapered capsule of the body, attached to a joint.
struct BodyPart {
  std::uint16_t joint;
  Vec3d a, b;
  double ra, rb;
  double squash;  ///< depth (z) of the cross-section relative to its width
  int color;      ///< 0 skin, 1 shirt, 2 trousers, 3 hair, 4 shoes
};

/// Distance-like value of one part: negative inside.
inline double part_value(const BodyPart& p, Vec3d x) noexcept {
  x.z = p.a.z + (x.z - p.a.z) / p.squash;
  Vec3d b = p.b;
  b.z = p.a.z + (b.z - p.a.z) / p.squash;
  const Vec3d ab = b - p.a;
  const double t = std::clamp(dot(x - p.a, ab) / std::max(dot(ab, ab), 1e-12), 0.0, 1.0);
  return norm(x - (p.a + ab * t)) - (p.ra + (p.rb - p.ra) * t);
}

/// Smooth union of all parts (exponential, 2 cm wide).
inline double body_value(const std::vector<BodyPart>& parts, const Vec3d& x) noexcept {
  double sum = 0;
  for (const BodyPart& p : parts) sum += std::exp(-part_value(p, x) * 80.0);
  return -std::log(sum) / 80.0;
}

}  // namespace detail

/// The embedded default person: SMPL-X joint names, a body of tapered capsules blended smoothly, Gaussians
/// flattened on its surface, weights by distance to the bones around each point.
inline AvatarAsset make_humanoid(const HumanoidOptions& options = {}) {
  using detail::BodyPart;
  AvatarAsset asset;
  asset.skeleton = detail::smplx_skeleton(options.height);
  const std::vector<BodyPart> parts = [&] {
    std::vector<BodyPart> v;
    const double s = options.height / 1.70;
    const auto joint = [&](const char* name) {
      for (std::size_t j = 0; j < asset.skeleton.names.size(); ++j) {
        if (asset.skeleton.names[j] == name) return static_cast<std::uint16_t>(j);
      }
      return std::uint16_t{0};
    };
    const auto add = [&](const char* name, Vec3d a, Vec3d b, double ra, double rb, double squash, int color) {
      v.push_back({joint(name), a * s, b * s, ra * s, rb * s, squash, color});
    };
    add("pelvis", {-0.06, 0.93, 0}, {0.06, 0.93, 0}, 0.115, 0.115, 0.85, 2);
    add("spine1", {-0.04, 1.06, 0}, {0.04, 1.06, 0}, 0.115, 0.115, 0.8, 1);
    add("spine2", {-0.06, 1.17, 0}, {0.06, 1.17, 0}, 0.12, 0.12, 0.8, 1);
    add("spine3", {-0.09, 1.30, 0}, {0.09, 1.30, 0}, 0.115, 0.115, 0.8, 1);
    add("neck", {0, 1.40, 0}, {0, 1.50, -0.01}, 0.058, 0.052, 1, 0);
    add("head", {0, 1.58, -0.015}, {0, 1.62, 0}, 0.082, 0.088, 1.15, 0);
    add("head", {0, 1.60, 0.012}, {0, 1.635, 0.015}, 0.09, 0.09, 1.12, 3);
    add("head", {0, 1.57, -0.105}, {0, 1.555, -0.112}, 0.012, 0.014, 1, 0);
    for (const int side : {-1, 1}) {
      const double x = side;
      const std::string p = side < 0 ? "left_" : "right_";
      const auto limb = [&](const char* name, Vec3d a, Vec3d b, double ra, double rb, double squash, int color) {
        add((p + name).c_str(), {x * a.x, a.y, a.z}, {x * b.x, b.y, b.z}, ra, rb, squash, color);
      };
      limb("collar", {0.06, 1.375, 0}, {0.16, 1.385, 0}, 0.07, 0.068, 0.9, 1);
      limb("shoulder", {0.19, 1.38, 0}, {0.31, 1.38, 0}, 0.064, 0.052, 1, 1);
      limb("shoulder", {0.31, 1.38, 0}, {0.43, 1.38, 0}, 0.047, 0.042, 1, 0);
      limb("elbow", {0.45, 1.38, 0}, {0.68, 1.38, 0}, 0.042, 0.030, 1, 0);
      limb("wrist", {0.71, 1.38, 0}, {0.78, 1.38, 0}, 0.034, 0.030, 0.8, 0);
      limb("wrist", {0.79, 1.38, -0.005}, {0.855, 1.375, -0.005}, 0.024, 0.014, 1.1, 0);
      limb("hip", {0.095, 0.87, 0}, {0.10, 0.53, 0}, 0.092, 0.062, 1, 2);
      limb("knee", {0.10, 0.49, 0}, {0.10, 0.12, 0.02}, 0.06, 0.043, 1, 2);
      limb("ankle", {0.10, 0.055, 0.03}, {0.10, 0.045, -0.06}, 0.046, 0.043, 1, 4);
      limb("foot", {0.10, 0.040, -0.07}, {0.10, 0.036, -0.14}, 0.042, 0.034, 1, 4);
    }
    return v;
  }();

  Rng rng(options.seed);
  // Each part gets points by its area; those inside another part are dropped, the rest slide onto the
  // blended surface.
  std::vector<double> areas;
  for (const BodyPart& p : parts) {
    areas.push_back(6.283 * 0.5 * (p.ra + p.rb) * (norm(p.b - p.a) + p.ra + p.rb));
  }
  double total = 0;
  for (const double a : areas) total += a;
  const double spacing = std::sqrt(0.75 * total / options.gaussians);
  GaussianCloudBuilder builder(0, "procedural humanoid");
  std::vector<Vec3d> points;
  const Vec3d palette[5] = {options.skin, options.shirt, options.trousers, options.hair, options.shoes};
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const BodyPart& p = parts[part];
    const int count = static_cast<int>(std::lround(options.gaussians * 1.35 * areas[part] / total));
    for (int i = 0; i < count; ++i) {
      const double t = rng.uniform(-p.ra, norm(p.b - p.a) + p.rb) / std::max(norm(p.b - p.a), 1e-9);
      Vec3d direction = normalized(Vec3d{rng.normal(), rng.normal(), rng.normal()});
      const Vec3d axis = normalized(p.b - p.a);
      const bool cap = t < 0 || t > 1;
      if (!cap) direction = normalized(direction - axis * dot(direction, axis));
      if (cap && dot(direction, axis) * (t < 0 ? -1 : 1) < 0) direction = -direction;
      const double tc = std::clamp(t, 0.0, 1.0);
      Vec3d x = p.a + (p.b - p.a) * tc + direction * (p.ra + (p.rb - p.ra) * tc);
      x.z = p.a.z + (p.b.z - p.a.z) * tc + (x.z - (p.a.z + (p.b.z - p.a.z) * tc)) * p.squash;
      Vec3d n{};
      const double h = 1e-4;
      bool inside = false;
      for (int k = 0; k < 4 && !inside; ++k) {
        const double f = detail::body_value(parts, x);
        inside = f < -0.03;
        n = normalized(Vec3d{detail::body_value(parts, x + Vec3d{h, 0, 0}) - f,
                             detail::body_value(parts, x + Vec3d{0, h, 0}) - f,
                             detail::body_value(parts, x + Vec3d{0, 0, h}) - f});
        x -= n * f;
      }
      if (inside) continue;
      int color = p.color;
      double best = 1e9;
      for (const BodyPart& q : parts) {
        const double value = detail::part_value(q, x);
        if (value < best) {
          best = value;
          color = q.color;
        }
      }
      if (color == 3 && x.z < -0.045 * options.height / 1.7) color = 0;  // face under the hair line
      RawGaussian g;
      g.mean = x;
      const Vec3d side = normalized(cross(std::abs(n.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}, n));
      g.quat = quat_from_matrix(transpose(Mat3d{{side, cross(n, side), n}}));
      g.log_scales = {std::log(0.75 * spacing), std::log(0.75 * spacing), std::log(0.12 * spacing)};
      g.opacity_logit = 4.0;
      const double shade = (0.86 + 0.14 * n.y) * (1 + 0.03 * rng.normal());
      for (std::size_t c = 0; c < 3; ++c) {
        g.sh0[c] = static_cast<float>((palette[color][static_cast<int>(c)] * shade - 0.5) / kSh0);
      }
      if (builder.add(g)) points.push_back(x);
    }
  }
  asset.canonical = builder.cloud();
  detail::bind_skin(asset.skeleton, points, asset.joint_indices, asset.skinning_weights);
  asset.stride = 1.36 * options.height / 1.70;
  for (const BodyPart& p : parts) {
    if (p.color == 3) continue;
    asset.capsules.push_back({p.joint, {p.a, p.b, std::max(p.ra, p.rb) * std::max(1.0, p.squash) + 0.015}});
  }
  return asset;
}

}  // namespace gsnav
