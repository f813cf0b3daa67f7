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

TEST_CASE_TEMPLATE("N04 needles of 1e4 to 1 keep their determinant", S, float, double) {
  Rng rng(4);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const double s_max = std::pow(10.0, rng.uniform(-1, 2));
    ProjectionCamera<S> camera = make_projection_camera<S>(axis_camera(1024, 1000), GaussianSet{});
    Quatd qd{rng.normal(), rng.normal(), rng.normal(), rng.normal()};
    normalize(qd);
    const Quat<S> q = quat_cast<S>(qd);
    const Vec3<S> scales{S(s_max), S(s_max * 1e-4), S(s_max * 1e-4)};
    const Vec3<S> delta{S(rng.uniform(-3, 3)), S(rng.uniform(-3, 3)), S(rng.uniform(5, 10))};
    const auto p = project<S, float>(camera, splat_axes(camera.rotation, delta, q, scales), 5.0f, S(0.9));
    // a b = kWhitenScale^2 / sqrt(det), so the determinant is what the triple says it is.
    const long double product = static_cast<long double>(p.a) * p.b;
    const long double det = std::pow(static_cast<long double>(kWhitenScale), 4) / (product * product);
    // Reference from the same inputs in long double: A C - B^2 of the dilated covariance.
    const long double x = delta.x, y = delta.y, z = delta.z;
    const long double u = std::clamp<long double>(x / z, static_cast<long double>(camera.u_min),
                                                  static_cast<long double>(camera.u_max));
    const long double v = std::clamp<long double>(y / z, static_cast<long double>(camera.v_min),
                                                  static_cast<long double>(camera.v_max));
    const Quat<long double> ql{q.w, q.x, q.y, q.z};
    const long double n = std::sqrt(ql.w * ql.w + ql.x * ql.x + ql.y * ql.y + ql.z * ql.z);
    const Mat3<long double> r = rotation_matrix(Quat<long double>{ql.w / n, ql.x / n, ql.y / n, ql.z / n});
    long double a = 0.3f, b = 0, c = 0.3f;
    for (int k = 0; k < 3; ++k) {
      const long double s = scales[k];
      const long double l1 = 1000 / z * s * (r(0, k) - u * r(2, k));
      const long double l2 = 1000 / z * s * (r(1, k) - v * r(2, k));
      a += l1 * l1;
      b += l1 * l2;
      c += l2 * l2;
    }
    worst = std::max(worst, static_cast<double>(std::abs(det / (a * c - b * b) - 1)));
    CHECK(product > 0);
  }
  CHECK(worst < (sizeof(S) == 4 ? 2e-4 : 1e-10));
}

TEST_CASE("N07 a long needle's alpha stays within 5e-4 in float") {
  GaussianCloudBuilder b(0);
  RawGaussian g = gaussian({0, 0, 2}, {2, 2e-4, 2e-4}, 0.95);
  g.quat = axis_angle(Vec3d{0, 0, 1}, 0.7853);
  b.add(g);
  Camera camera = axis_camera(512, 1000);  // sigma of 1000 px along the diagonal
  camera.cx = camera.cy = 256.25;
  const OracleImage o = oracle_render({&b.cloud()}, camera);
  const auto f = render_all<float>(b.cloud(), camera);
  CHECK(image_error(f.alpha, o.alpha, 1, o.undecided).max < 5e-4);
  CHECK(*std::max_element(f.alpha.begin(), f.alpha.end()) > 0.9f);
}

TEST_CASE_TEMPLATE("N06 a flat disk edge-on, and a point, are finite", S, float, double) {
  GaussianCloudBuilder b(0);
  RawGaussian g = gaussian({0, 0, 3}, {0.1, 0.1, 0.1}, 0.9);
  g.log_scales = {std::log(0.2), std::log(0.2), -std::numeric_limits<double>::infinity()};
  g.quat = axis_angle(Vec3d{0, 1, 0}, 1.5707963267948966);
  b.add(g);
  g.log_scales = {-20, -20, -20};
  g.mean = {0.5, 0.5, 3};
  b.add(g);
  g.log_scales = {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                  -std::numeric_limits<double>::infinity()};
  g.mean = {-0.5, 0.5, 3};
  b.add(g);
  const auto f = render_all<S>(b.cloud(), axis_camera());
  for (const auto* image : {&f.rgb, &f.alpha, &f.median_depth, &f.expected_depth}) {
    for (const S v : *image) CHECK(is_finite(v));
  }
  // The point is its filter alone: alpha at its nearest pixel centre.
  const double px = 64 * (0.5 / 3) + 32.5, dx = 0.5 + std::floor(px) - px;
  const std::size_t at = static_cast<std::size_t>(std::floor(px)) * 66;
  CHECK(static_cast<double>(f.alpha[at]) ==
        doctest::Approx(0.9 * std::exp(-dx * dx / 0.3)).epsilon(1e-4));
}

TEST_CASE_TEMPLATE("N10 huge and close Gaussians give finite images", S, float, double) {
  for (const double z : {1e-6, 1e-4, 1e-2}) {
    Camera camera = axis_camera();
    camera.near_plane = 1e-7;
    const GaussianCloud cloud = cloud_of({gaussian({0, 0, z}, {10, 10, 10}, 0.7),
                                          gaussian({0.3, 0, z}, {1e8, 1e-3, 1e8}, 0.7),
                                          gaussian({0, 0, 2}, {0.1, 0.1, 0.1}, 0.5)});
    const auto f = render_all<S>(cloud, camera);
    for (const auto* image : {&f.rgb, &f.alpha, &f.median_depth, &f.expected_depth}) {
      for (const S v : *image) CHECK(is_finite(v));
    }
  }
}

TEST_CASE("N11 no pixel of a footprint is missed") {
  // Every Gaussian alone at every pixel, by the pixel test itself, against the tiled image.
  Rng rng(11);
  for (int round = 0; round < 60; ++round) {
    const GaussianCloud cloud =
        random_cloud(100 + static_cast<std::uint64_t>(round),
                     {.count = 1, .sh_degree = 0, .needle = 0.7, .scale = std::pow(10, rng.uniform(-3, 1))});
    const Camera camera = axis_camera(61, 40);
    const OracleImage o = oracle_render({&cloud}, camera);
    for (const int tile : {8, 16, 32}) {
      RenderConfig config;
      config.tile_size = tile;
      SerialBackend serial;
      const auto f = render<float>(serial, {cloud.set()}, camera, config);
      for (std::size_t p = 0; p < o.alpha.size(); ++p) {
        if (!o.undecided[p] && std::abs(o.alpha[p] * 255 - 1) > 1e-3L) {
          CHECK((f.alpha[p] > 0) == (o.alpha[p] > 0));
        }
      }
    }
  }
}

TEST_CASE_TEMPLATE("N16 the near plane is exclusive, to the last bit", S, float, double) {
  Camera camera = axis_camera();
  camera.near_plane = 0.5;
  const auto peak = [&](float z) {
    const auto f = render_all<S>(cloud_of({gaussian({0, 0, z}, {0.01, 0.01, 0.01}, 0.5)}), camera);
    return *std::max_element(f.alpha.begin(), f.alpha.end());
  };
  CHECK(peak(0.5f) == S(0));
  CHECK(peak(std::nextafter(0.5f, 1.0f)) > S(0.4));
  CHECK(peak(std::nextafter(0.5f, 0.0f)) == S(0));
}

TEST_CASE_TEMPLATE("N17 a camera inside a Gaussian does not draw it under the sensors' rule", S, float,
                   double) {
  Camera camera = axis_camera();
  camera.near_plane = 0.01;
  camera.near_sigma = 1;
  const auto peak = [&](double z) {
    const auto f = render_all<S>(cloud_of({gaussian({0, 0, z}, {0.5, 0.5, 0.5}, 0.5)}), camera);
    return *std::max_element(f.alpha.begin(), f.alpha.end());
  };
  CHECK(peak(0.0) == S(0));
  CHECK(peak(0.4) == S(0));
  CHECK(peak(0.6) > S(0));
}

TEST_CASE_TEMPLATE("N21 equal depths blend in file order", S, float, double) {
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 64; ++i) {
    gs.push_back(gaussian({0, 0, 3}, {0.3, 0.3, 0.01}, 0.3, {static_cast<float>(i % 7), 1, 0}));
  }
  const auto f = render_all<S>(cloud_of(gs), axis_camera());
  double transmittance = 1, red = 0;
  const std::size_t center = 32 * 65 + 32;
  for (int i = 0; i < 64; ++i) {
    const double color = 0.5 + 0.28209479177387814 * (i % 7);
    red += 0.3 * transmittance * color;
    transmittance *= 0.7;
    if (transmittance < 1e-4) break;
  }
  CHECK(static_cast<double>(f.rgb[3 * center]) == doctest::Approx(red).epsilon(1e-5));
}

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
