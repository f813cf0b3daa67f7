// SPDX-License-Identifier: Apache-2.0
// Numerical hard cases; each on float and double, against closed forms or long double.
#include <doctest/doctest.h>

#include "ops/backends.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

RawGaussian gaussian(Vec3d mean, Vec3d scales, double opacity, std::array<float, 3> sh0 = {0, 0, 0}) {
  RawGaussian g;
  g.mean = mean;
  g.log_scales = {std::log(scales.x), std::log(scales.y), std::log(scales.z)};
  g.opacity_logit = std::log(opacity / (1 - opacity));
  g.sh0 = sh0;
  return g;
}

GaussianCloud cloud_of(const std::vector<RawGaussian>& gs) {
  GaussianCloudBuilder b(0);
  for (const RawGaussian& g : gs) b.add(g);
  return b.cloud();
}

/// Camera at the origin looking along +z with a pixel centre on the axis.
Camera axis_camera(int size = 65, double f = 64) {
  Camera c;
  c.width = c.height = size;
  c.fx = c.fy = f;
  c.cx = c.cy = 0.5 * size;
  return c;
}

template <class S>
Frames<S> render_all(const GaussianCloud& cloud, const Camera& camera) {
  RenderConfig config;
  config.outputs = kRgb | kAlpha | kAnyDepth;
  SerialBackend serial;
  return render<S>(serial, {cloud.set()}, camera, config);
}

}  // namespace

TEST_CASE_TEMPLATE("N41 to N43 opaque, saturating and faint stacks", S, float, double) {
  const std::size_t center = 32 * 65 + 32;
  const auto stack = [&](const std::vector<double>& opacities) {
    std::vector<RawGaussian> gs;
    double z = 2;
    for (const double o : opacities) gs.push_back(gaussian({0, 0, z += 0.01}, {5, 5, 1e-4}, o, {1, 1, 1}));
    return render_all<S>(cloud_of(gs), axis_camera());
  };
  RawGaussian opaque = gaussian({0, 0, 2}, {5, 5, 1e-4}, 0.5);
  opaque.opacity_logit = std::numeric_limits<double>::infinity();
  CHECK(static_cast<double>(render_all<S>(cloud_of({opaque}), axis_camera()).alpha[center]) ==
        doctest::Approx(0.99).epsilon(1e-6));
  // The Gaussian that takes T below 1e-4 is blended.
  CHECK(static_cast<double>(stack({0.985, 0.985, 0.985}).alpha[center]) ==
        doctest::Approx(1 - 0.015 * 0.015 * 0.015).epsilon(1e-7));
  // 500 layers just under 1/255 leave nothing; just over it they add up.
  CHECK(stack(std::vector<double>(500, 0.0039)).alpha[center] == S(0));
  const double faint = 0.00393;
  CHECK(static_cast<double>(stack(std::vector<double>(500, faint)).alpha[center]) ==
        doctest::Approx(1 - std::pow(1 - static_cast<double>(static_cast<float>(faint)), 500)).epsilon(2e-5));
}

TEST_CASE_TEMPLATE("N45 depth definitions on two layers", S, float, double) {
  for (const double a : {0.1, 0.49, 0.51, 0.9}) {
    const GaussianCloud cloud =
        cloud_of({gaussian({0, 0, 2}, {5, 5, 1e-5}, a), gaussian({0, 0, 4}, {9, 9, 1e-5}, 0.98)});
    const auto f = render_all<S>(cloud, axis_camera());
    const std::size_t center = 32 * 65 + 32;
    const double w1 = a, w2 = (1 - a) * 0.98;
    CHECK(static_cast<double>(f.accumulated_depth[center]) == doctest::Approx(2 * w1 + 4 * w2).epsilon(1e-5));
    CHECK(static_cast<double>(f.expected_depth[center]) ==
          doctest::Approx((2 * w1 + 4 * w2) / (w1 + w2)).epsilon(1e-5));
    CHECK(static_cast<double>(f.median_depth[center]) == doctest::Approx(a > 0.5 ? 2 : 4).epsilon(1e-5));
  }
}

TEST_CASE_TEMPLATE("N46 a tilted disk's depth is its plane, not its centre", S, float, double) {
  GaussianCloudBuilder b(0);
  RawGaussian g = gaussian({0, 0, 3}, {0.2, 0.2, 0.2}, 0.95);
  g.log_scales.z = -20;
  const double tilt = 80 * 3.14159265358979323846 / 180;
  g.quat = axis_angle(Vec3d{0, 1, 0}, tilt);
  b.add(g);
  const auto f = render_all<S>(b.cloud(), axis_camera());
  const Vec3d normal = rotate(g.quat, Vec3d{0, 0, 1});
  int seen = 0;
  for (int x = 0; x < 65; ++x) {
    const std::size_t p = 32 * 65 + static_cast<std::size_t>(x);
    if (f.median_depth[p] == S(0)) continue;
    ++seen;
    const Vec3d ray{(x + 0.5 - 32.5) / 64, 0, 1};
    CHECK(static_cast<double>(f.median_depth[p]) == doctest::Approx(3 * normal.z / dot(normal, ray)).epsilon(1e-4));
  }
  CHECK(seen >= 2);
}

TEST_CASE_TEMPLATE("N48 a faint surface gives no return", S, float, double) {
  const auto f = render_all<S>(cloud_of({gaussian({0, 0, 2}, {5, 5, 1e-4}, 0.3)}), axis_camera());
  for (const S d : f.median_depth) CHECK(d == S(0));
  CHECK(f.alpha[32 * 65 + 32] > S(0.29));
}
