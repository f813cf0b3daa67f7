// SPDX-License-Identifier: Apache-2.0
// Every backend and precision against the contract's image computed independently in long double.
#include <doctest/doctest.h>

#include "ops/backends.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr unsigned kEverything = kRgb | kAlpha | kAnyDepth;

Camera test_camera(int variant) {
  Camera c = Camera::look_at({0.3, -0.2, 0.5}, {0.1, 0.1, 4}, {0, -1, 0.1}, 72, 50, 80);
  if (variant == 1) {  // off-centre principal point, unequal focal lengths
    c.cx = 20.5;
    c.cy = 33.25;
    c.fx = 50;
    c.fy = 61;
  }
  if (variant == 2) c = Camera::look_at({0, 0, 4.2}, {1, 0.3, 3.5}, {0, -1, 0}, 64, 64, 110);  // inside
  return c;
}

template <class S>
void check(const Frames<S>& f, const OracleImage& o, double color_max, double depth_max) {
  const ImageError rgb = image_error(f.rgb, o.rgb, 3, o.undecided);
  const ImageError alpha = image_error(f.alpha, o.alpha, 1, o.undecided);
  CHECK(rgb.max <= color_max);
  CHECK(alpha.max <= color_max);
  std::size_t compared = 0;
  for (std::size_t p = 0; p < o.alpha.size(); ++p) {
    if (o.undecided[p] || o.undecided_depth[p]) continue;
    ++compared;
    CHECK(std::abs(static_cast<double>(f.median_depth[p] - o.median[p])) <= depth_max);
    CHECK(std::abs(static_cast<double>(f.first_hit_depth[p] - o.first_hit[p])) <= depth_max);
    CHECK(std::abs(static_cast<double>(f.accumulated_depth[p] - o.accumulated[p])) <= depth_max);
    if (o.alpha[p] > 0.05L) {
      CHECK(std::abs(static_cast<double>(f.expected_depth[p] - o.expected[p])) <= depth_max);
    }
  }
  CHECK(compared > o.alpha.size() / 2);
}

}  // namespace

TEST_CASE("all images equal the long double oracle on random scenes with needles") {
  for (int seed = 0; seed < 4; ++seed) {
    for (int variant = 0; variant < 3; ++variant) {
      CAPTURE(seed);
      CAPTURE(variant);
      CloudOptions options;
      options.sh_degree = seed;
      options.mip = seed == 3;
      const GaussianCloud cloud = random_cloud(static_cast<std::uint64_t>(seed) + 10, options);
      Camera camera = test_camera(variant);
      RenderConfig config;
      config.outputs = kEverything;
      config.background = {0.2, 0.5, 0.7};
      OracleOptions rules;
      rules.background = config.background;
      const OracleImage oracle = oracle_render({&cloud}, camera, rules);
      SerialBackend serial;
      check(render<double>(serial, {cloud.set()}, camera, config), oracle, 1e-9, 1e-9);
      check(render<float>(serial, {cloud.set()}, camera, config), oracle, 1e-4, 2e-4);
#if defined(_OPENMP)
      OpenMPBackend openmp(2);
      check(render<float>(openmp, {cloud.set()}, camera, config), oracle, 1e-4, 2e-4);
      check(render<double>(openmp, {cloud.set()}, camera, config), oracle, 1e-9, 1e-9);
#endif
    }
  }
}

TEST_CASE("the fast profile stays within its budget") {
  const GaussianCloud cloud = random_cloud(77, {.count = 800});
  const Camera camera = test_camera(0);
  const OracleImage oracle = oracle_render({&cloud}, camera);
  RenderConfig config;
  config.quality = Quality::fast();
  SerialBackend serial;
  const ImageError e =
      image_error(render<float>(serial, {cloud.set()}, camera, config).rgb, oracle.rgb, 3);
  CHECK(e.psnr >= 65);
  CHECK(e.max <= 6.0 / 255);
}

TEST_CASE("sets are one sorted list: two halves render as the whole") {
  const GaussianCloud all = random_cloud(5, {.count = 300});
  GaussianCloudBuilder first(3), second(3);
  for (std::size_t i = 0; i < all.size(); ++i) {
    RawGaussian g;
    g.mean = all.mean(i);
    g.quat = {all.quats[0][i], all.quats[1][i], all.quats[2][i], all.quats[3][i]};
    for (std::size_t k = 0; k < 3; ++k) {
      g.log_scales[static_cast<int>(k)] = std::log(static_cast<double>(all.scales[k][i]));
      g.sh0[k] = all.sh0[3 * i + k];
    }
    const double o = all.opacities[i];
    g.opacity_logit = std::log(o / (1 - o));
    g.shN = all.shN.data() + 45 * i;
    (i % 2 == 0 ? first : second).add(g);
  }
  const Camera camera = test_camera(0);
  SerialBackend serial;
  const auto whole = render<double>(serial, {all.set()}, camera);
  const auto halves = render<double>(serial, {first.cloud().set(), second.cloud().set()}, camera);
  // The halves went through log and exp once more, hence not bit for bit.
  CHECK(image_error(halves.rgb, whole.rgb, 3).max < 1e-5);
  const OracleImage oracle = oracle_render({&first.cloud(), &second.cloud()}, camera);
  CHECK(image_error(halves.rgb, oracle.rgb, 3, oracle.undecided).max < 1e-9);
}

TEST_CASE("max_alpha and the stop are fields of the configuration") {
  const GaussianCloud cloud = random_cloud(9, {.count = 400});
  const Camera camera = test_camera(0);
  RenderConfig config;
  config.quality.max_alpha = 0.9;
  config.quality.transmittance_min = 0.05;
  OracleOptions rules;
  rules.max_alpha = 0.9L;
  rules.transmittance_min = static_cast<Real>(0.05);
  const OracleImage oracle = oracle_render({&cloud}, camera, rules);
  SerialBackend serial;
  const auto f = render<double>(serial, {cloud.set()}, camera, config);
  CHECK(image_error(f.rgb, oracle.rgb, 3, oracle.undecided).max < 1e-9);
}
