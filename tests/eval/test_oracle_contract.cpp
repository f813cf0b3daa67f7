// SPDX-License-Identifier: Apache-2.0
// The float64 oracle of the contract against closed forms, the long double oracle and Brush's images.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "eval/oracle_support.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/frame/sh.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "hard_cases/cases.hpp"
#include "support/brush.hpp"
#include "support/compiled_frames.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

double color_of(const GaussianCloud& cloud, std::size_t i, std::size_t channel) {
  return 0.5 + kSh0 * static_cast<double>(cloud.sh0[3 * i + channel]);
}

RawGaussian opaque(const Vec3d& mean, const Vec3d& scales, const std::array<float, 3>& sh0) {
  RawGaussian g = gaussian(mean, scales, 0.5, sh0);
  g.opacity_logit = std::numeric_limits<double>::infinity();
  return g;
}

}  // namespace

TEST_CASE("oracle: one Gaussian on the axis, by its closed form") {
  const GaussianCloud cloud =
      cloud_of({gaussian({0, 0, 2}, {0.1, 0.05, 0.2}, 0.8, {0.3f, -0.4f, 1.2f})});
  const Camera camera = axis_camera();
  OracleConfig config;
  config.rules.background = {0.1, 0.2, 0.3};
  const OracleFrames f = oracle({cloud.set()}, camera, config);
  const double sx = static_cast<double>(cloud.scales[0][0]),
               sy = static_cast<double>(cloud.scales[1][0]),
               sz = static_cast<double>(cloud.scales[2][0]), o = static_cast<double>(cloud.opacities[0]);
  const double h = static_cast<double>(0.3f);
  const double a = std::pow(64 * sx / 2, 2) + h, c = std::pow(64 * sy / 2, 2) + h;
  const double reach = std::sqrt(2 * std::log(255 * o)) * sz;
  std::uint64_t drawn = 0;
  for (std::size_t p = 0; p < f.alpha.size(); ++p) {
    const double dx = static_cast<double>(p % kAxisSize) - kAxisMiddle,
                 dy = static_cast<double>(p / kAxisSize) - kAxisMiddle;
    double alpha = o * std::exp(-0.5 * (dx * dx / a + dy * dy / c));
    if (alpha < 1.0 / 255) alpha = 0;
    CHECK(std::abs(f.alpha[p] - alpha) < 1e-13);
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const double expected =
          alpha * color_of(cloud, 0, ch) + (1 - alpha) * config.rules.background[static_cast<int>(ch)];
      CHECK(std::abs(f.rgb[3 * p + ch] - expected) < 1e-13);
    }
    const double u = dx / 64, v = dy / 64;
    const double z = (2 / (sz * sz)) / (u * u / (sx * sx) + v * v / (sy * sy) + 1 / (sz * sz));
    const double depth = alpha > 0 ? std::clamp(z, 2 - reach, 2 + reach) : 0;
    CHECK(std::abs(f.expected_depth[p] - depth) < 1e-12);
    CHECK(std::abs(f.accumulated_depth[p] - alpha * depth) < 1e-12);
    CHECK(std::abs(f.median_depth[p] - (alpha >= 0.5 ? depth : 0)) < 1e-12);
    drawn += alpha > 0 ? 1 : 0;
  }
  CHECK(f.counts.gaussians == 1);
  CHECK(f.counts.visible == 1);
  CHECK(f.counts.evaluations == drawn);
  // The box is the ellipse's: 4 / pi of its pixels, and the rounding of its sides to whole pixels.
  CHECK(f.counts.listed >= drawn);
  CHECK(f.counts.listed < 1.5 * static_cast<double>(drawn));
}

TEST_CASE("oracle: two layers, their depths and what is marked undecided") {
  const Vec3d wide{0.5, 0.5, 0.01};
  const GaussianCloud cloud =
      cloud_of({gaussian({0, 0, 4}, wide, 0.7, {1, 0, 0}), gaussian({0, 0, 2}, wide, 0.6, {0, 1, -1})});
  OracleConfig config;
  config.rules.first_hit_tau = 0.8;
  config.rules.background = {1, 1, 1};
  const OracleFrames f = oracle({cloud.set()}, axis_camera(), config);
  const std::size_t center = kAxisPixel;
  const double o1 = static_cast<double>(cloud.opacities[1]),
               o2 = static_cast<double>(cloud.opacities[0]);
  const double w1 = o1, w2 = (1 - o1) * o2, t = (1 - o1) * (1 - o2);
  for (std::size_t c = 0; c < 3; ++c) {
    const double expected = w1 * color_of(cloud, 1, c) + w2 * color_of(cloud, 0, c) + t;
    CHECK(std::abs(f.rgb[3 * center + c] - expected) < 1e-14);
  }
  CHECK(std::abs(f.alpha[center] - (1 - t)) < 1e-14);
  CHECK(f.median_depth[center] == doctest::Approx(2).epsilon(1e-14));
  CHECK(f.first_hit_depth[center] == doctest::Approx(4).epsilon(1e-14));
  CHECK(f.accumulated_depth[center] == doctest::Approx(2 * w1 + 4 * w2).epsilon(1e-14));
  CHECK(f.expected_depth[center] == doctest::Approx((2 * w1 + 4 * w2) / (w1 + w2)).epsilon(1e-14));
  CHECK(f.undecided[center] == 0);
  CHECK(f.undecided_depth[center] == 0);

  const auto at_center = [&](const std::vector<RawGaussian>& g, const auto& mask,
                             const OracleConfig& c = {}) {
    const GaussianCloud drawn = cloud_of(g);
    return int{mask(oracle({drawn.set()}, axis_camera(), c))[center]};
  };
  const auto undecided = [](const OracleFrames& r) { return r.undecided; };
  const auto undecided_depth = [](const OracleFrames& r) { return r.undecided_depth; };
  CHECK(at_center({gaussian({0, 0, 2}, wide, (1 + 5e-6) / 255)}, undecided) == 1);
  CHECK(at_center({gaussian({0, 0, 2}, wide, (1 + 5e-5) / 255)}, undecided) == 0);
  OracleConfig faint;
  faint.rules.quality.alpha_min = 0.01;
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.01 * (1 - 5e-6))}, undecided, faint) ==
        1);  // and not drawn
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.01 * (1 - 5e-5))}, undecided, faint) == 0);
  // Twice max_alpha is T = 1e-4, the stop.
  CHECK(at_center({opaque({0, 0, 2}, wide, {}), opaque({0, 0, 3}, wide, {})}, undecided) == 1);
  CHECK(at_center({opaque({0, 0, 2}, wide, {}), gaussian({0, 0, 3}, wide, 0.98)}, undecided) == 0);
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.4995)}, undecided_depth) == 1);
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.498)}, undecided_depth) == 0);
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.8005)}, undecided_depth, config) == 1);
  CHECK(at_center({gaussian({0, 0, 2}, wide, 0.8005)}, undecided_depth) == 0);
}

TEST_CASE("oracle: a pixel is closed by the Gaussian that takes T below the stop, which counts") {
  std::vector<RawGaussian> layers;
  for (int i = 0; i < 5; ++i) layers.push_back(opaque({0, 0, 2.0 + i}, {0.5, 0.5, 0.01}, {}));
  OracleConfig config;
  config.rules.quality.transmittance_min = 0.95e-4;  // the second layer's T is 1e-4
  const GaussianCloud cloud = cloud_of(layers);
  const std::size_t center = kAxisPixel;
  const OracleFrames f = oracle({cloud.set()}, axis_camera(), config);
  CHECK(f.alpha[center] == doctest::Approx(1 - 1e-6).epsilon(1e-14));
  config.crop = {kAxisMiddle, kAxisMiddle, kAxisMiddle + 1, kAxisMiddle + 1};
  CHECK(oracle({cloud.set()}, axis_camera(), config).counts.evaluations == 3);
  config.kind = OracleKind::untruncated;
  const OracleFrames u = oracle({cloud.set()}, axis_camera(), config);
  CHECK(u.counts.evaluations == 5);
  CHECK(u.alpha[0] == doctest::Approx(1 - 1e-10).epsilon(1e-14));
}

TEST_CASE("oracle: keys that tie in float32 and not in float64") {
  // A kilometre away float32 keys are 6e-5 m apart; the first in the file stands 1e-6 m behind.
  const Vec3d wide{100, 100, 1};
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 1 + 0x1p-20}, wide, 0.6, {1, -1, 0}),
                                        gaussian({0, 0, 1}, wide, 0.7, {-1, 1, 0})});
  Camera camera = axis_camera();
  camera.viewmat.translation = {0, 0, 1000.3};
  const std::size_t center = kAxisPixel;
  for (const SortOrder sort : {SortOrder::z_depth, SortOrder::camera_distance}) {
    OracleConfig config;
    config.rules.sort_order = sort;
    for (const OracleOrder order : {OracleOrder::float32_key, OracleOrder::float64}) {
      config.order = order;
      const OracleFrames f = oracle({cloud.set()}, camera, config);
      const std::size_t front = order == OracleOrder::float32_key ? 0 : 1, back = 1 - front;
      const double o1 = static_cast<double>(cloud.opacities[front]),
                   o2 = static_cast<double>(cloud.opacities[back]);
      for (std::size_t c = 0; c < 3; ++c) {
        const double expected =
            o1 * color_of(cloud, front, c) + (1 - o1) * o2 * color_of(cloud, back, c);
        CHECK(std::abs(f.rgb[3 * center + c] - expected) < 1e-12);
      }
      CHECK(f.order_flip[center] == 1);
      CHECK(f.counts.order_flips ==
            static_cast<std::uint64_t>(std::count(f.order_flip.begin(), f.order_flip.end(), 1)));
      CHECK(f.order_flip[0] == 0);  // nothing reaches the corner
    }
  }
}

TEST_CASE("oracle: ties go by the file's order, however rows lie in memory") {
  // Layers that face the camera, in two sets: runs of equal depth.
  Rng rng(212);
  std::vector<RawGaussian> front, back;
  for (int i = 0; i < 600; ++i) {
    RawGaussian g = gaussian({rng.uniform(-1, 1), rng.uniform(-1, 1), 2.0 + 0.5 * (i % 2)},
                             {0.2, 0.2, 0.01}, 0.7, {0, 0, 0});
    for (float& c : g.sh0) c = static_cast<float>(rng.normal());
    (i % 3 == 0 ? back : front).push_back(g);
  }
  const GaussianCloud a = cloud_of(front), b = cloud_of(back);
  GaussianCloud a_sorted = a, b_sorted = b;
  sort_spatially(a_sorted);
  sort_spatially(b_sorted);
  REQUIRE(!std::is_sorted(a_sorted.row_ids.begin(), a_sorted.row_ids.end()));
  for (const OracleOrder order :
       {OracleOrder::float32_key, OracleOrder::float64, OracleOrder::per_ray}) {
    OracleConfig config;
    config.order = order;
    const OracleFrames f = oracle({a.set(), b.set()}, axis_camera(), config);
    CHECK(same_images(f, oracle({a_sorted.set(), b_sorted.set()}, axis_camera(), config)));
    CHECK(same_images(f, oracle({a.set(), b_sorted.set()}, axis_camera(), config)));
    CHECK(!same_images(f, oracle({b.set(), a.set()}, axis_camera(), config)));
  }
}

TEST_CASE("oracle: codes and halves are read as renderers read them") {
  GaussianCloud cloud = random_cloud(70, {.count = 700, .sh_degree = 3, .needle = 0.2});
  sort_spatially(cloud);
  GaussianCloud halves = cloud;
  compact_sh(halves);
  GaussianCloud of_halves = halves;
  expand_sh(of_halves);
  const PackLimits any{1e9, 1e9, 1e9}, float_means{0, 1e9, 1e9}, half_bands{1e9, 0, 1e9};
  CHECK(same_images(oracle({halves.set()}, axis_camera()), oracle({of_halves.set()}, axis_camera())));
  for (const PackLimits& limits : {any, float_means, half_bands}) {
    const PackedCloud packed = pack_cloud(cloud, limits);
    const GaussianCloud floats = unpack_cloud(packed);
    CHECK(same_images(oracle({packed.set()}, axis_camera()), oracle({floats.set()}, axis_camera())));
  }
}

TEST_CASE("oracle: factors replace rotations and scales, as in the renderer") {
  const GaussianCloud small = random_cloud(71, {.count = 100, .needle = 0.2});
  GaussianCloud large = small;
  std::array<std::vector<float>, 9> factors;
  for (std::size_t i = 0; i < small.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) large.scales[k][i] = 2 * small.scales[k][i];
    const Mat3d r = rotation_matrix(
        Quatd{small.quats[0][i], small.quats[1][i], small.quats[2][i], small.quats[3][i]});
    for (std::size_t k = 0; k < 9; ++k) {
      factors[k].push_back(static_cast<float>(r(static_cast<int>(k / 3), static_cast<int>(k % 3)) *
                                              static_cast<double>(large.scales[k % 3][i])));
    }
  }
  GaussianSet set = small.set();
  set.gaussians.shape.axes = planes_of(factors);
  const OracleFrames f = oracle({set}, axis_camera()), truth = oracle({large.set()}, axis_camera());
  SerialBackend serial;
  BasicRenderer<double, SerialBackend> renderer(serial, RenderConfig{.outputs = kRgb | kAlpha});
  const auto rendered = renderer.render(std::vector{set}, {{axis_camera()}}).value();
  std::vector<bool> skip(f.alpha.size());
  for (std::size_t p = 0; p < skip.size(); ++p) skip[p] = f.undecided[p] != 0;
  CHECK(image_error(rendered.rgb, f.rgb, 3, skip).max < 1e-11);
  CHECK(image_error(rendered.alpha, f.alpha, 1, skip).max < 1e-11);
  for (std::size_t p = 0; p < skip.size(); ++p) skip[p] = skip[p] || truth.undecided[p] != 0;
  CHECK(image_error(f.rgb, truth.rgb, 3, skip).max < 1e-3);  // the factors' own rounding to float
}

TEST_CASE("oracle: the long double oracle on random scenes") {
  for (int seed = 0; seed < 4; ++seed) {
    CAPTURE(seed);
    CloudOptions options;
    options.sh_degree = seed;
    options.mip = seed % 2 == 1;
    const GaussianCloud cloud = random_cloud(static_cast<std::uint64_t>(seed) + 50, options);
    const GaussianCloud second = random_cloud(static_cast<std::uint64_t>(seed) + 60, {.count = 50});
    Camera camera = Camera::look_at({0.3, -0.2, 0.5}, {0.1, 0.1, 4}, {0, -1, 0.1}, 60, 42, 80);
    if (seed == 1) camera.cx = 11.5, camera.cy = 30.25, camera.fy = 44;
    if (seed == 2) camera = Camera::look_at({0, 0, 4.2}, {1, 0.3, 3.5}, {0, -1, 0}, 48, 48, 110);
    OracleConfig config;
    config.rules.background = {0.2, 0.5, 0.7};
    OracleOptions rules;
    rules.background = config.rules.background;
    const OracleImage truth = gsnav_test::oracle_render({&cloud, &second}, camera, rules);
    const OracleFrames f = oracle({cloud.set(), second.set()}, camera, config);
    CHECK(image_error(f.rgb, truth.rgb, 3, truth.undecided).max < 1e-11);
    CHECK(image_error(f.alpha, truth.alpha, 1, truth.undecided).max < 1e-11);
    for (std::size_t p = 0; p < f.alpha.size(); ++p) {
      CHECK(bool{f.undecided[p] != 0} == truth.undecided[p]);
      CHECK(bool{f.undecided_depth[p] != 0} == truth.undecided_depth[p]);
      if (truth.undecided[p] || truth.undecided_depth[p]) continue;
      CHECK(std::abs(f.median_depth[p] - static_cast<double>(truth.median[p])) < 1e-9);
      CHECK(std::abs(f.first_hit_depth[p] - static_cast<double>(truth.first_hit[p])) < 1e-9);
      CHECK(std::abs(f.accumulated_depth[p] - static_cast<double>(truth.accumulated[p])) < 1e-9);
      CHECK(std::abs(f.expected_depth[p] - static_cast<double>(truth.expected[p])) < 1e-9);
    }
  }
}

TEST_CASE("oracle: Brush's reference images") {
  for (const char* name : kBrushCases) {
    const auto brush = brush_case(name);
    if (!brush) continue;
    CAPTURE(name);
    OracleConfig config;
    config.rules.quality.max_alpha = brush->max_alpha;
    config.rules.quality.transmittance_min = brush->transmittance_min;
    const OracleFrames f = oracle({brush->cloud.set()}, brush->camera, config);
    CHECK(brush->error(f.rgb, f.alpha) < 1e-5);
  }
}

TEST_CASE("oracle: what cannot be is named") {
  const GaussianCloud cloud = cloud_of({gaussian({0, 0, 2}, {0.1, 0.1, 0.1}, 0.5)});
  SerialBackend backend;
  const auto message = [&](const OracleConfig& config, const Camera& camera = axis_camera()) {
    const auto r = eval::oracle_render(backend, cloud.set(), camera, config);
    CHECK(!r.ok());
    return r.message();
  };
  OracleConfig config;
  config.rules.response = Response::ray;
  CHECK(message(config).find("rules.response") != std::string::npos);
  config = {};
  config.rules.compat = Compat::inria;
  CHECK(message(config).find("rules.compat") != std::string::npos);
  config = {};
  const OracleMesh mesh;
  config.mesh = &mesh;
  config.rules.composite = Composite::hard_depth;
  CHECK(message(config).find("rules.composite") != std::string::npos);
  config.rules.composite = Composite::merged;
  config.rules.blend_space = ColorSpace::linear;
  CHECK(message(config).find("rules.blend_space") != std::string::npos);
  config = {};
  config.rules.quality.max_alpha = 2;
  CHECK(message(config).find("max_alpha") != std::string::npos);
  for (const PixelRect crop :
       {PixelRect{3, 3, 3, 5}, PixelRect{0, 0, kAxisSize + 1, 10}, PixelRect{-1, 0, 5, 5}}) {
    config = {};
    config.crop = crop;
    CHECK(message(config).find("crop") != std::string::npos);
  }
  Camera camera = axis_camera();
  camera.fx = 0;
  CHECK(message({}, camera).find("fx") != std::string::npos);
  GaussianSet set = cloud.set();
  set.eps2d = 0;
  CHECK(eval::oracle_render(backend, set, axis_camera()).message().find("eps2d") != std::string::npos);
  const auto nothing = eval::oracle_render(backend, std::span<const GaussianSet>(), axis_camera());
  CHECK(nothing.value().alpha == std::vector<double>(kAxisSize * kAxisSize, 0.0));
}
