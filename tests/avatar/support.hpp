// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "gsnav/avatar/avatar.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "hard_cases/cases.hpp"

namespace gsnav_test {

/// A rotation by at most `degrees`.
inline gsnav::Quatd rotation_within(gsnav::Rng& rng, double degrees) {
  const gsnav::Vec3d axis = gsnav::normalized(gsnav::Vec3d{rng.normal(), rng.normal(), rng.normal()});
  return gsnav::axis_angle(axis, rng.uniform(0, degrees) * 0.017453292519943295);
}

/// Angle between two rotations, degrees; accurate near 0.
inline double angle_between(const gsnav::Quatd& a, const gsnav::Quatd& b) {
  const gsnav::Quatd d = gsnav::conjugate(a) * b;
  return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w)) * 57.29577951308232;
}

/// Eigenvectors (columns) and eigenvalues of a symmetric matrix by cyclic Jacobi rotations.
inline void jacobi(gsnav::Mat3d a, gsnav::Mat3d& vectors, double (&values)[3]) {
  vectors = gsnav::Mat3d::identity();
  for (int sweep = 0; sweep < 60; ++sweep) {
    for (int p = 0; p < 3; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        if (std::abs(a(p, q)) < 1e-300) continue;
        const double theta = 0.5 * std::atan2(2 * a(p, q), a(q, q) - a(p, p));
        gsnav::Mat3d r = gsnav::Mat3d::identity();
        r(p, p) = r(q, q) = std::cos(theta);
        r(p, q) = std::sin(theta);
        r(q, p) = -std::sin(theta);
        a = gsnav::transpose(r) * a * r;
        vectors = vectors * r;
      }
    }
  }
  for (int k = 0; k < 3; ++k) values[k] = a(k, k);
}

/// Polar factor of b by way of the square root of b^T b: another road than the kernel's.
inline gsnav::Mat3d polar_oracle(const gsnav::Mat3d& b) {
  gsnav::Mat3d v;
  double l[3];
  jacobi(gsnav::transpose(b) * b, v, l);
  gsnav::Mat3d scaled = v;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) scaled(i, k) /= std::sqrt(l[k]);
  }
  return b * (scaled * gsnav::transpose(v));
}

/// The default person, made once.
inline std::shared_ptr<const gsnav::AvatarAsset> person() {
  static const auto asset = std::make_shared<const gsnav::AvatarAsset>(gsnav::make_humanoid());
  return asset;
}

/// Skins in scalar S into planes of Out.
template <class S, class Out>
struct SkinnedPlanes {
  std::vector<Out> means[3], quats[4], rotations[4];
  gsnav::Vec3d mean(std::size_t i) const {
    return gsnav::vec_cast<double>(gsnav::Vec3<Out>{means[0][i], means[1][i], means[2][i]});
  }
  gsnav::Quatd quat(std::size_t i) const {
    return gsnav::quat_cast<double>(gsnav::Quat<Out>{quats[0][i], quats[1][i], quats[2][i], quats[3][i]});
  }
};

template <class S, class Out>
SkinnedPlanes<S, Out> skin_all(const gsnav::AvatarAsset& asset, const std::vector<gsnav::Affine3<double>>& joints) {
  std::vector<gsnav::Affine3<S>> cast;
  for (const auto& m : joints) cast.push_back(gsnav::affine_cast<S>(m));
  SkinnedPlanes<S, Out> out;
  gsnav::SkinningArgs<S, Out> args;
  const auto view = asset.cloud.view();
  for (std::size_t k = 0; k < 3; ++k) {
    out.means[k].resize(asset.size());
    args.means[k] = view.means[k];
    args.means_out[k] = gsnav::view_of(out.means[k]);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    out.quats[k].resize(asset.size());
    out.rotations[k].resize(asset.size());
    args.quats[k] = view.quats[k];
    args.quats_out[k] = gsnav::view_of(out.quats[k]);
    args.rotations_out[k] = gsnav::view_of(out.rotations[k]);
  }
  args.joint_indices = gsnav::view_of(asset.joint_indices);
  args.weights = gsnav::view_of(asset.skinning_weights);
  args.joints = {cast.data(), cast.size()};
  gsnav::SerialBackend backend;
  gsnav::skin_gaussians<S>(backend, args).throw_if_error();
  return out;
}

}  // namespace gsnav_test
