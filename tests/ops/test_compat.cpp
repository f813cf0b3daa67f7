// SPDX-License-Identifier: Apache-2.0
// RenderConfig::compat against the other renderers' rules written out a second time: explicit
// covariances, tiles of 16 pixels, the Gaussian that would close a pixel left out.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

struct Emulated {
  std::vector<double> rgb, alpha, accumulated, expected;
};

struct EmulatedSplat {
  float key;
  double x, y, z, opacity, inverse[3], color[3];
  int x0, x1, y0, y1;  // tiles of 16 pixels, ends excluded
};

/// The splats of a cloud, nearest first.
std::vector<EmulatedSplat> emulated_splats(const GaussianCloud& cloud, const Camera& camera,
                                           Compat compat) {
  std::vector<EmulatedSplat> splats;
  const int w = camera.width, h = camera.height;
  const int columns = (w + 15) / 16, rows = (h + 15) / 16;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EmulatedSplat s{};
    const Vec3d t = cloud.mean(i);
    s.z = t.z;
    s.key = static_cast<float>(t.z);
    if (t.z <= 0.2) continue;
    Quatd q{cloud.quats[0][i], cloud.quats[1][i], cloud.quats[2][i], cloud.quats[3][i]};
    normalize(q);
    const Mat3d r = rotation_matrix(q);
    double sigma[3][3] = {};
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        for (std::size_t k = 0; k < 3; ++k) {
          const double scale = cloud.scales[k][i];
          sigma[a][b] += r(a, static_cast<int>(k)) * scale * scale * r(b, static_cast<int>(k));
        }
      }
    }
    const double u = t.x / t.z, v = t.y / t.z;
    const double uj = std::clamp(u, -1.3 * w / (2 * camera.fx), 1.3 * w / (2 * camera.fx));
    const double vj = std::clamp(v, -1.3 * h / (2 * camera.fy), 1.3 * h / (2 * camera.fy));
    const double jx[3] = {camera.fx / t.z, 0, -camera.fx * uj / t.z};
    const double jy[3] = {0, camera.fy / t.z, -camera.fy * vj / t.z};
    double a = 0, b = 0, c = 0;
    for (int m = 0; m < 3; ++m) {
      for (int n = 0; n < 3; ++n) {
        a += jx[m] * sigma[m][n] * jx[n];
        b += jx[m] * sigma[m][n] * jy[n];
        c += jy[m] * sigma[m][n] * jy[n];
      }
    }
    const double det0 = a * c - b * b;
    a += 0.3f;
    c += 0.3f;
    const double det = a * c - b * b;
    s.opacity = cloud.opacities[i];
    if (compat == Compat::habitat_gs) s.opacity *= std::sqrt(std::max(2.5e-5, det0 / det));
    s.inverse[0] = c / det;
    s.inverse[1] = -b / det;
    s.inverse[2] = a / det;
    s.x = camera.fx * u + camera.cx;
    s.y = camera.fy * v + camera.cy;
    if (compat == Compat::gsplat) {
      if (s.opacity < 1 / 255.0) continue;
      const double extent = std::min(3.33, std::sqrt(2 * std::log(255 * s.opacity)));
      const double rx = std::ceil(extent * std::sqrt(a)), ry = std::ceil(extent * std::sqrt(c));
      s.x0 = std::clamp(static_cast<int>(std::floor((s.x - rx) / 16)), 0, columns);
      s.x1 = std::clamp(static_cast<int>(std::ceil((s.x + rx) / 16)), 0, columns);
      s.y0 = std::clamp(static_cast<int>(std::floor((s.y - ry) / 16)), 0, rows);
      s.y1 = std::clamp(static_cast<int>(std::ceil((s.y + ry) / 16)), 0, rows);
    } else {
      const double mid = 0.5 * (a + c);
      const double radius = std::ceil(3 * std::sqrt(mid + std::sqrt(std::max(0.1, mid * mid - det))));
      const double px = s.x - 0.5, py = s.y - 0.5;  // its pixel centres are integers
      s.x0 = std::clamp(static_cast<int>((px - radius) / 16), 0, columns);
      s.x1 = std::clamp(static_cast<int>((px + radius + 15) / 16), 0, columns);
      s.y0 = std::clamp(static_cast<int>((py - radius) / 16), 0, rows);
      s.y1 = std::clamp(static_cast<int>((py + radius + 15) / 16), 0, rows);
    }
    for (int k = 0; k < 3; ++k) {
      s.color[k] =
          std::max(0.0, 0.5 + 0.28209479177387814 * cloud.sh0[3 * i + static_cast<std::size_t>(k)]);
    }
    splats.push_back(s);
  }
  std::stable_sort(splats.begin(), splats.end(), [](auto& l, auto& r) { return l.key < r.key; });
  return splats;
}

/// Degree-0 clouds at the origin of the world, camera at the origin looking along +z.
Emulated emulate(const GaussianCloud& cloud, const Camera& camera, Compat compat) {
  const std::vector<EmulatedSplat> splats = emulated_splats(cloud, camera, compat);
  Emulated out;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      double transmittance = 1, color[3] = {}, depth = 0;
      for (const EmulatedSplat& s : splats) {
        if (x / 16 < s.x0 || x / 16 >= s.x1 || y / 16 < s.y0 || y / 16 >= s.y1) continue;
        const double dx = x + 0.5 - s.x, dy = y + 0.5 - s.y;
        const double power =
            -0.5 * (s.inverse[0] * dx * dx + 2 * s.inverse[1] * dx * dy + s.inverse[2] * dy * dy);
        const double alpha = std::min(0.99, s.opacity * std::exp(power));
        if (power > 0 || alpha < 1 / 255.0) continue;
        const double next = transmittance * (1 - alpha);
        if (compat == Compat::gsplat ? next <= 1e-4 : next < 1e-4) break;
        for (int k = 0; k < 3; ++k) color[k] += alpha * transmittance * s.color[k];
        depth += alpha * transmittance * s.z;
        transmittance = next;
      }
      out.rgb.insert(out.rgb.end(), color, color + 3);
      out.alpha.push_back(1 - transmittance);
      out.accumulated.push_back(depth);
      const double cut = compat == Compat::habitat_gs ? 0.01 : 0.0;
      out.expected.push_back(1 - transmittance > cut ? depth / (1 - transmittance) : 0);
    }
  }
  return out;
}

}  // namespace

TEST_CASE("compat modes follow the rules of the renderer they name") {
  for (const Compat compat : {Compat::inria, Compat::gsplat, Compat::habitat_gs}) {
    for (const std::uint64_t seed : {3u, 4u, 5u}) {
      CAPTURE(static_cast<int>(compat));
      CloudOptions options;
      options.count = 500;
      options.sh_degree = 0;
      options.scale = 0.15;  // deep enough to close pixels
      const GaussianCloud cloud = random_cloud(seed, options);
      Camera camera;
      camera.set_hfov(88, 60, 75);
      const Emulated truth = emulate(cloud, camera, compat);
      RenderConfig config;
      config.compat = compat;
      config.outputs = kRgb | kAlpha | kAnyDepth;
      const auto check = [&](const auto& f, double bound) {
        CHECK(image_error(f.rgb, truth.rgb, 3).psnr > bound);
        CHECK(image_error(f.alpha, truth.alpha, 1).psnr > bound);
        double worst = 0;
        for (std::size_t p = 0; p < truth.alpha.size(); ++p) {
          if (std::abs(truth.alpha[p] - 0.01) < 1e-4) continue;
          worst =
              std::max(worst, std::abs(static_cast<double>(f.expected_depth[p]) - truth.expected[p]));
          CHECK(static_cast<double>(f.accumulated_depth[p]) ==
                doctest::Approx(truth.accumulated[p]).epsilon(1e-3));
        }
        CHECK(worst < 1e-2);
      };
      SerialBackend serial;
      config.tuning.tile_size = 8;
      const auto exact = render<double>(serial, {cloud.set()}, camera, config);
      check(exact, 150);
      config.tuning.tile_size = 16;
      CHECK(render<double>(serial, {cloud.set()}, camera, config).rgb == exact.rgb);
      const auto single = render<float>(serial, {cloud.set()}, camera, config);
      check(single, 80);
#if defined(_OPENMP)
      OpenMPBackend openmp(2);
      const auto lanes = render<float>(openmp, {cloud.set()}, camera, config);
      CHECK(lanes.rgb == single.rgb);
      CHECK(lanes.alpha == single.alpha);
      CHECK(lanes.expected_depth == single.expected_depth);
#endif
      // The contract is something else: its footprint is not cut at tiles and closes inclusively.
      config.compat = Compat::none;
      const auto contract = render<double>(serial, {cloud.set()}, camera, config);
      const double psnr = image_error(contract.rgb, truth.rgb, 3).psnr;
      CHECK(psnr < 100);
      MESSAGE("contract against compat: " << psnr << " dB");
    }
  }
}

TEST_CASE("responses: serial and lanes agree bit for bit") {
#if defined(_OPENMP)
  for (const Response response : {Response::tangent_plane, Response::ray}) {
    const GaussianCloud cloud = random_cloud(11, {.count = 400, .scale = 0.2});
    Camera camera = Camera::look_at({0.3, -0.2, 2.5}, {0.1, 0.1, 4}, {0, -1, 0.1}, 72, 50, 120);
    RenderConfig config;
    config.response = response;
    config.outputs = kRgb | kAlpha | kAnyDepth;
    SerialBackend serial;
    OpenMPBackend openmp(2);
    const auto a = render<float>(serial, {cloud.set()}, camera, config);
    for (const int tile : {8, 16, 32}) {
      config.tuning.tile_size = tile;
      const auto b = render<float>(openmp, {cloud.set()}, camera, config);
      CHECK(a.rgb == b.rgb);
      CHECK(a.median_depth == b.median_depth);
      CHECK(a.expected_depth == b.expected_depth);
    }
    config.response = Response::ewa;
    CHECK(render<float>(serial, {cloud.set()}, camera, config).rgb != a.rgb);
  }
#endif
}
