// SPDX-License-Identifier: Apache-2.0
#include "support/oracle.hpp"

#include <algorithm>
#include <cmath>

namespace gsnav_test {

namespace {

struct OracleSplat {
  Real z, u, v, px, py, inv_a, inv_b, inv_c, opacity, reach;
  Real precision[3][3], mean[3];
  Real color[3];
};

Real sh_basis(int k, Real x, Real y, Real z) {
  const Real pi = 3.14159265358979323846264338327950288L;
  switch (k) {
    case 0:
      return std::sqrt(1 / (4 * pi));
    case 1:
      return -std::sqrt(3 / (4 * pi)) * y;
    case 2:
      return std::sqrt(3 / (4 * pi)) * z;
    case 3:
      return -std::sqrt(3 / (4 * pi)) * x;
    case 4:
      return std::sqrt(15 / pi) / 2 * x * y;
    case 5:
      return -std::sqrt(15 / pi) / 2 * y * z;
    case 6:
      return std::sqrt(5 / pi) / 4 * (3 * z * z - 1);
    case 7:
      return -std::sqrt(15 / pi) / 2 * x * z;
    case 8:
      return std::sqrt(15 / pi) / 4 * (x * x - y * y);
    case 9:
      return -std::sqrt(35 / (2 * pi)) / 4 * y * (3 * x * x - y * y);
    case 10:
      return std::sqrt(105 / pi) / 2 * x * y * z;
    case 11:
      return -std::sqrt(21 / (2 * pi)) / 4 * y * (5 * z * z - 1);
    case 12:
      return std::sqrt(7 / pi) / 4 * (5 * z * z * z - 3 * z);
    case 13:
      return -std::sqrt(21 / (2 * pi)) / 4 * x * (5 * z * z - 1);
    case 14:
      return std::sqrt(105 / pi) / 4 * (x * x - y * y) * z;
    default:
      return -std::sqrt(35 / (2 * pi)) / 4 * x * (x * x - 3 * y * y);
  }
}

bool invert3(const Real m[3][3], Real out[3][3]) {
  const auto minor = [&](int r, int c) {
    const int a = (r + 1) % 3, b = (r + 2) % 3, d = (c + 1) % 3, e = (c + 2) % 3;
    return m[a][d] * m[b][e] - m[a][e] * m[b][d];
  };
  const Real det = m[0][0] * minor(0, 0) + m[0][1] * minor(0, 1) + m[0][2] * minor(0, 2);
  if (det == 0) return false;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out[i][j] = minor(j, i) / det;
  }
  return true;
}

/// World to camera: r v + t.
struct OracleView {
  explicit OracleView(const gsnav::Camera& camera) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) r[i][j] = camera.viewmat.linear(i, j);
      t[i] = camera.viewmat.translation[i];
    }
    // The eye: where r v + t is 0; r is a rotation.
    for (int j = 0; j < 3; ++j) {
      eye[j] = 0;
      for (int i = 0; i < 3; ++i) eye[j] -= r[i][j] * t[i];
    }
  }
  Real r[3][3], t[3], eye[3];
};

/// Covariance of Gaussian n in camera axes.
void covariance_in_camera(const gsnav::GaussianCloud& cloud, std::size_t n, const Real r[3][3],
                          Real view[3][3]) {
  Real q[4];
  for (std::size_t k = 0; k < 4; ++k) q[k] = cloud.quats[k][n];
  const Real qn = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (Real& c : q) c /= qn;
  const Real w = q[0], x = q[1], y = q[2], z = q[3];
  const Real rot[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                          {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                          {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  Real sigma[3][3] = {};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Real sc = cloud.scales[k][n];
        sigma[i][j] += rot[i][k] * sc * sc * rot[j][k];
      }
    }
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      view[i][j] = 0;
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) view[i][j] += r[i][a] * sigma[a][b] * r[j][b];
      }
    }
  }
}

/// Colour of Gaussian n seen along d, of any length.
void shade(const gsnav::GaussianCloud& cloud, std::size_t n, const Real d[3], Real color[3]) {
  const Real dn = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const int coefficients = (cloud.sh_degree + 1) * (cloud.sh_degree + 1);
  for (std::size_t ch = 0; ch < 3; ++ch) {
    Real sum = 0;
    for (int k = 0; k < coefficients; ++k) {
      const float value = k == 0 ? cloud.sh0[3 * n + ch]
                                 : cloud.shN[(n * static_cast<std::size_t>(coefficients - 1) +
                                              static_cast<std::size_t>(k - 1)) *
                                                 3 +
                                             ch];
      sum += sh_basis(k, d[0] / dn, d[1] / dn, d[2] / dn) * value;
    }
    color[ch] = std::max<Real>(sum + 0.5L, 0);
  }
}

/// Projects Gaussian n. False where it is not drawn.
bool project(const gsnav::GaussianCloud& cloud, std::size_t n, const gsnav::Camera& camera,
             const OracleView& to_camera, OracleSplat& s) {
  const auto& r = to_camera.r;
  const auto& t = to_camera.t;
  Real mean[3];
  for (std::size_t k = 0; k < 3; ++k) mean[k] = cloud.means[k][n];
  if (!cloud.origins.empty()) {
    const auto& origin = cloud.origins[cloud.origin_ids.empty() ? 0 : cloud.origin_ids[n]];
    mean[0] += origin.x;
    mean[1] += origin.y;
    mean[2] += origin.z;
  }
  for (int i = 0; i < 3; ++i) {
    s.mean[i] = r[i][0] * mean[0] + r[i][1] * mean[1] + r[i][2] * mean[2] + t[i];
  }
  s.z = s.mean[2];
  if (s.z <= camera.near_plane) return false;
  s.u = s.mean[0] / s.z;
  s.v = s.mean[1] / s.z;
  s.px = camera.fx * s.u + camera.cx;
  s.py = camera.fy * s.v + camera.cy;

  Real view[3][3];
  covariance_in_camera(cloud, n, r, view);
  const Real tx = 0.3L * camera.width / (2 * camera.fx), ty = 0.3L * camera.height / (2 * camera.fy);
  const Real uj =
      std::clamp<Real>(s.u, -(camera.cx / camera.fx + tx), (camera.width - camera.cx) / camera.fx + tx);
  const Real vj =
      std::clamp<Real>(s.v, -(camera.cy / camera.fy + ty), (camera.height - camera.cy) / camera.fy + ty);
  const Real jac[2][3] = {{camera.fx / s.z, 0, -camera.fx * uj / s.z},
                          {0, camera.fy / s.z, -camera.fy * vj / s.z}};
  Real cov[2][2] = {};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) cov[i][j] += jac[i][a] * view[a][b] * jac[j][b];
      }
    }
  }
  const Real det0 = cov[0][0] * cov[1][1] - cov[0][1] * cov[0][1];
  const Real h = cloud.eps2d;
  const Real a = cov[0][0] + h, c = cov[1][1] + h, b = cov[0][1];
  const Real det = a * c - b * b;
  s.inv_a = c / det;
  s.inv_b = -b / det;
  s.inv_c = a / det;
  s.opacity = cloud.opacities[n];
  if (cloud.filter == gsnav::Filter::mip) s.opacity *= std::sqrt(std::max<Real>(det0, 0) / det);
  if (s.opacity * 255 < 1) return false;
  s.reach = std::sqrt(2 * std::log(255 * s.opacity)) * std::sqrt(view[2][2]);
  invert3(view, s.precision);

  const Real d[3] = {mean[0] - to_camera.eye[0], mean[1] - to_camera.eye[1], mean[2] - to_camera.eye[2]};
  shade(cloud, n, d, s.color);
  return true;
}

/// Blends pixel p, nearest splat first.
void blend_pixel(const std::vector<OracleSplat>& splats, const gsnav::Camera& camera,
                 const OracleOptions& options, std::size_t p, OracleImage& out) {
  const Real x = static_cast<Real>(p % out.width) + 0.5L, y = static_cast<Real>(p / out.width) + 0.5L;
  const Real ray[3] = {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1};
  Real transmittance = 1, weights = 0;
  bool crossed = false, first = false;
  for (const OracleSplat& s : splats) {
    const Real dx = x - s.px, dy = y - s.py;
    const Real q = s.inv_a * dx * dx + 2 * s.inv_b * dx * dy + s.inv_c * dy * dy;
    const Real raw = s.opacity * std::exp(-q / 2);
    if (std::abs(raw * 255 - 1) < 1e-5L) out.undecided[p] = true;
    if (raw < 1 / 255.0L) continue;
    const Real alpha = std::min(options.max_alpha, raw);
    Real num = 0, den = 0;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        num += ray[i] * s.precision[i][j] * s.mean[j];
        den += ray[i] * s.precision[i][j] * ray[j];
      }
    }
    const Real z = std::clamp(num / den, s.z - s.reach, s.z + s.reach);
    const Real weight = alpha * transmittance;
    for (std::size_t ch = 0; ch < 3; ++ch) out.rgb[3 * p + ch] += weight * s.color[ch];
    weights += weight;
    out.accumulated[p] += weight * z;
    transmittance -= weight;
    if (!crossed && transmittance <= 0.5L) {
      out.median[p] = z;
      crossed = true;
    }
    if (std::abs(transmittance - 0.5L) < 1e-3L) out.undecided_depth[p] = true;
    if (!first && 1 - transmittance >= options.first_hit_tau) {
      out.first_hit[p] = z;
      first = true;
    }
    if (std::abs(transmittance / options.transmittance_min - 1) < 1e-5L) out.undecided[p] = true;
    if (transmittance < options.transmittance_min) break;
  }
  for (std::size_t ch = 0; ch < 3; ++ch) {
    out.rgb[3 * p + ch] += transmittance * options.background[static_cast<int>(ch)];
  }
  out.alpha[p] = 1 - transmittance;
  out.expected[p] = weights > 0 ? out.accumulated[p] / weights : 0;
}

}  // namespace

OracleImage oracle_render(const std::vector<const gsnav::GaussianCloud*>& clouds,
                          const gsnav::Camera& camera, const OracleOptions& options) {
  std::vector<OracleSplat> splats;
  const OracleView to_camera(camera);
  for (const gsnav::GaussianCloud* cloud : clouds) {
    for (std::size_t n = 0; n < cloud->size(); ++n) {
      OracleSplat s{};
      if (project(*cloud, n, camera, to_camera, s)) splats.push_back(s);
    }
  }
  std::stable_sort(splats.begin(), splats.end(), [](const OracleSplat& a, const OracleSplat& b) {
    return static_cast<float>(a.z) < static_cast<float>(b.z);
  });

  OracleImage out;
  out.width = static_cast<std::size_t>(camera.width);
  out.height = static_cast<std::size_t>(camera.height);
  const std::size_t pixels = out.width * out.height;
  out.rgb.assign(3 * pixels, 0);
  for (auto* image : {&out.alpha, &out.median, &out.expected, &out.accumulated, &out.first_hit}) {
    image->assign(pixels, 0);
  }
  out.undecided.assign(pixels, false);
  out.undecided_depth.assign(pixels, false);
  for (std::size_t p = 0; p < pixels; ++p) blend_pixel(splats, camera, options, p, out);
  return out;
}

}  // namespace gsnav_test
