// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "gsnav/detail/frame/projection_camera.hpp"
#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"

// What one Gaussian's alpha is, in long double and by the textbook: explicit covariance matrices, AC -
// B^2 and explicit inverses. Shares no formula with the kernels. Cameras stand at the origin and look
// along +z.

namespace gsnav_test {

using Real = long double;

/// One Gaussian as it is stored: float32 parameters, in long double.
struct TruthSplat {
  Real mean[3]{}, quat[4]{1, 0, 0, 0}, scale[3]{};
  Real opacity = 1, eps2d = 0.3f;
  bool mip = false;
};

inline TruthSplat truth_of(const gsnav::GaussianCloud& cloud, std::size_t i) {
  TruthSplat t;
  const gsnav::Vec3d mean = cloud.mean(i);
  for (int k = 0; k < 3; ++k) {
    t.mean[k] = mean[k];
    t.scale[k] = cloud.scales[static_cast<std::size_t>(k)][i];
  }
  for (std::size_t k = 0; k < 4; ++k) t.quat[k] = cloud.quats[k][i];
  t.opacity = cloud.opacities[i];
  t.eps2d = cloud.eps2d;
  t.mip = cloud.filter == gsnav::Filter::mip;
  return t;
}

/// Sigma = R diag(s^2) R^T.
inline void truth_covariance(const TruthSplat& t, Real sigma[3][3]) {
  Real q[4], n = 0;
  for (int k = 0; k < 4; ++k) n += t.quat[k] * t.quat[k];
  for (int k = 0; k < 4; ++k) q[k] = t.quat[k] / std::sqrt(n);
  const Real w = q[0], x = q[1], y = q[2], z = q[3];
  const Real r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                        {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                        {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      sigma[i][j] = 0;
      for (int k = 0; k < 3; ++k) sigma[i][j] += r[i][k] * t.scale[k] * t.scale[k] * r[j][k];
    }
  }
}

/// The 2D Gaussian of the linearisation at the mean.
struct Truth2d {
  Real x = 0, y = 0;         ///< mean, pixels
  Real a = 0, b = 0, c = 0;  ///< covariance with the dilation, px^2
  Real det0 = 0, det = 0;    ///< without and with the dilation
  Real opacity = 0;          ///< after the mip compensation
  Real compensation() const { return std::sqrt(std::max<Real>(det0, 0) / det); }
  /// Mahalanobis distance squared of a pixel centre.
  Real q(Real px, Real py) const {
    const Real dx = px - x, dy = py - y;
    return (c * dx * dx - 2 * b * dx * dy + a * dy * dy) / det;
  }
  Real alpha(Real px, Real py) const { return opacity * std::exp(-q(px, py) / 2); }
};

/// `clamped`: the contract's limits on x/z and y/z in the Jacobian.
inline Truth2d truth_project(const TruthSplat& t, const gsnav::Camera& camera, bool clamped = true) {
  Real sigma[3][3];
  truth_covariance(t, sigma);
  const Real z = t.mean[2], u = t.mean[0] / z, v = t.mean[1] / z;
  const Real fx = camera.fx, fy = camera.fy, cx = camera.cx, cy = camera.cy;
  const Real tx = 0.3L * camera.width / (2 * fx), ty = 0.3L * camera.height / (2 * fy);
  const Real uj = clamped ? std::clamp(u, -(cx / fx + tx), (camera.width - cx) / fx + tx) : u;
  const Real vj = clamped ? std::clamp(v, -(cy / fy + ty), (camera.height - cy) / fy + ty) : v;
  const Real j[2][3] = {{fx / z, 0, -fx * uj / z}, {0, fy / z, -fy * vj / z}};
  Real cov[2][2] = {};
  for (int m = 0; m < 2; ++m) {
    for (int n = 0; n < 2; ++n) {
      for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) cov[m][n] += j[m][k] * sigma[k][l] * j[n][l];
      }
    }
  }
  Truth2d out;
  out.x = fx * u + cx;
  out.y = fy * v + cy;
  out.det0 = cov[0][0] * cov[1][1] - cov[0][1] * cov[0][1];
  out.a = cov[0][0] + t.eps2d;
  out.b = cov[0][1];
  out.c = cov[1][1] + t.eps2d;
  out.det = out.a * out.c - out.b * out.b;
  out.opacity = t.mip ? t.opacity * out.compensation() : t.opacity;
  return out;
}

/// Largest response of the 3D Gaussian along a pixel's ray: its covariance is inverted and the distance
/// is taken at the parameter where its derivative vanishes. The dilation is eps2d px^2 at the mean's
/// depth, across the view axis. Alpha is 0 where that point lies behind the camera.
class TruthRay {
 public:
  TruthRay(const TruthSplat& t, const gsnav::Camera& camera) : splat_(t), camera_(camera) {
    Real s[3][3];
    truth_covariance(t, s);
    const Real z = t.mean[2], fx = camera.fx, fy = camera.fy;
    s[0][0] += t.eps2d * (z / fx) * (z / fx);
    s[1][1] += t.eps2d * (z / fy) * (z / fy);
    for (int i = 0; i < 3; ++i) {
      const int a = (i + 1) % 3, b = (i + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        const int d = (k + 1) % 3, e = (k + 2) % 3;
        adjugate_[k][i] = s[a][d] * s[b][e] - s[a][e] * s[b][d];
      }
    }
    det_ = s[0][0] * adjugate_[0][0] + s[0][1] * adjugate_[1][0] + s[0][2] * adjugate_[2][0];
    opacity_ = truth_project(t, camera, false).opacity;
  }

  /// Mahalanobis distance squared at the nearest point of the ray; negative where that is behind.
  Real q(Real px, Real py, Real* depth = nullptr) const {
    const Real r[3] = {(px - camera_.cx) / camera_.fx, (py - camera_.cy) / camera_.fy, 1};
    const Real at = form(r, splat_.mean) / form(r, r);
    if (depth != nullptr) *depth = at;
    if (at <= 0) return -1;
    Real d[3];
    for (int i = 0; i < 3; ++i) d[i] = at * r[i] - splat_.mean[i];
    return form(d, d);
  }
  /// Whether a ray is close to the line where its largest response goes behind the camera, so that alpha
  /// falls from some value to 0: form(r, c) / form(c, c), c the mean's ray, is 1 at the mean and 0
  /// there.
  bool at_horizon(Real px, Real py) const {
    const Real r[3] = {(px - camera_.cx) / camera_.fx, (py - camera_.cy) / camera_.fy, 1};
    const Real c[3] = {splat_.mean[0] / splat_.mean[2], splat_.mean[1] / splat_.mean[2], 1};
    return std::abs(form(r, c)) < 1e-4L * form(c, c);
  }
  /// `depth`: where given, z of that point.
  Real alpha(Real px, Real py, Real* depth = nullptr) const {
    const Real distance = q(px, py, depth);
    return distance < 0 ? 0 : opacity_ * std::exp(-distance / 2);
  }

 private:
  Real form(const Real a[3], const Real b[3]) const {
    Real sum = 0;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) sum += a[i] * adjugate_[i][k] * b[k];
    }
    return sum / det_;
  }

  TruthSplat splat_;
  gsnav::Camera camera_;
  Real adjugate_[3][3]{}, det_ = 0, opacity_ = 0;
};

/// Linearised on the plane through the mean across its direction: a pixel's ray is carried to that
/// plane, where the offset is exact, and the covariance is taken in the plane's own axes.
class TruthTangent {
 public:
  TruthTangent(const TruthSplat& t, const gsnav::Camera& camera)
      : flat_(truth_project(t, camera, false)) {
    for (int k = 0; k < 3; ++k) mean_[k] = t.mean[k];
    camera_ = camera;
  }
  /// The plane's offset, seen as pixels at the mean through the Jacobian there.
  Real q(Real px, Real py) const {
    const Real r[3] = {(px - camera_.cx) / camera_.fx, (py - camera_.cy) / camera_.fy, 1};
    Real along = 0, length2 = 0;
    for (int k = 0; k < 3; ++k) {
      along += r[k] * mean_[k];
      length2 += mean_[k] * mean_[k];
    }
    if (along <= 0) return -1;
    Real d[3];
    for (int k = 0; k < 3; ++k) d[k] = r[k] * length2 / along - mean_[k];
    const Real z = mean_[2];
    const Real dx = camera_.fx / z * (d[0] - mean_[0] / z * d[2]);
    const Real dy = camera_.fy / z * (d[1] - mean_[1] / z * d[2]);
    return flat_.q(flat_.x + dx, flat_.y + dy);
  }
  Real alpha(Real px, Real py) const {
    const Real distance = q(px, py);
    return distance < 0 ? 0 : flat_.opacity * std::exp(-distance / 2);
  }

 private:
  Truth2d flat_;
  Real mean_[3]{};
  gsnav::Camera camera_;
};

}  // namespace gsnav_test
