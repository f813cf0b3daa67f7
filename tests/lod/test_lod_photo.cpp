// SPDX-License-Identifier: Apache-2.0
// Levels of detail judged by O_photo, and the filter that pixels are seen through by a closed form.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <span>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "lod_support.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("lod photo: a Gaussian's light does not depend on how much a pixel blurs it") {
  // One Gaussian, far from the others' alpha cut: the sum of its alphas is opacity 2 pi sqrt(det(S +
  // base)).
  GaussianCloudBuilder builder(0);
  RawGaussian g;
  g.mean = {0.013, -0.007, 5};
  g.quat = {1, 0, 0, 0};
  g.log_scales = {std::log(0.05), std::log(0.02), std::log(0.001)};
  g.opacity_logit = 3;
  builder.add(g);
  const GaussianCloud cloud = builder.cloud();
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 5}, {0, -1, 0}, 33, 33, 60);
  SerialBackend backend;
  RenderConfig config;
  config.outputs = kAlpha;
  config.quality.alpha_min = 1e-7;
  BasicRenderer<double, SerialBackend> renderer(backend, config);
  const double per_metre = camera.fx / 5;
  for (const float base : {0.0f, 0.02f, 0.3f}) {
    for (const float blur : {0.3f, 0.5f}) {
      GaussianSet set = cloud.set();
      set.filter = Filter::mip;
      set.base_eps2d = base;
      set.eps2d = blur;
      const auto f = renderer.render(set, camera).value();
      double sum = 0;
      for (const double a : f.alpha) sum += a;
      const double sx = 0.05 * per_metre, sy = 0.02 * per_metre, b = static_cast<double>(base);
      const double light = static_cast<double>(cloud.opacities[0]) * 2 * std::numbers::pi *
                           std::sqrt((sx * sx + b) * (sy * sy + b));
      CAPTURE(base);
      CAPTURE(blur);
      // A pixel's samples at a variance of 0.3 ripple by 2 exp(-2 pi^2 0.3) = 0.54 % an axis.
      CHECK(sum == doctest::Approx(light).epsilon(0.012));
    }
  }
  GaussianSet set = cloud.set();
  set.base_eps2d = 0.4f;
  CHECK(validate(set).message().find("base_eps2d") != std::string::npos);
}

TEST_CASE("lod photo: base_eps2d = eps2d is the classic filter") {
  const GaussianCloud cloud = random_cloud(5, {.count = 300});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 40, 30, 70);
  SerialBackend backend;
  BasicRenderer<double, SerialBackend> renderer(backend);
  GaussianSet set = cloud.set();
  const auto classic = renderer.render(set, camera).value();
  set.filter = Filter::mip;
  set.base_eps2d = set.eps2d;
  const auto mip = renderer.render(set, camera).value();
  for (std::size_t i = 0; i < classic.rgb.size(); ++i)
    CHECK(std::abs(classic.rgb[i] - mip.rgb[i]) < 1e-6);
}

TEST_CASE("lod photo: nearer to the photo than direct rendering, in every view (N67)") {
  const GaussianCloud cloud = small_wall(11, 40000);
  OpenMPBackend backend;
  const LodTree tree = build_lod(backend, cloud).value();
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  BasicRenderer<float, OpenMPBackend> lods(backend, lod_config(config));
  LodCut cut(tree, cloud);
  double gain = 0;
  std::uint64_t drawn = 0, shown = 0;
  int views = 0;
  for (const double z :
       {-6.0, -2.0, 1.0, 3.0, 3.5}) {  // the last see few, large ones: direct rendering is good there
    for (const double x : {-1.0, 0.7}) {
      const Camera camera = Camera::look_at({x, 0.2, z}, {0, 0, 4}, {0, -1, 0}, 40, 40, 50);
      const GaussianSet whole = cloud.set();
      const auto truth = eval::oracle_photo(backend, std::span(&whole, 1), camera, 4).value();
      const auto direct = renderer.render(whole, camera).value();
      const auto sets = cut.select(camera);
      lods.set_config(lod_config(config));
      const auto lod = lods.render(sets, std::span(&camera, 1)).value();
      const double before = image_error(truth.rgb, direct.rgb, 3).psnr,
                   after = image_error(truth.rgb, lod.rgb, 3).psnr;
      CAPTURE(z);
      CAPTURE(x);
      MESSAGE("direct " << before << " dB, lod " << after << " dB, " << cut.stats().drawn << " of "
                        << cut.stats().shown << " drawn");
      CHECK(after >= before);
      gain += after - before;
      drawn += cut.stats().drawn;
      shown += cut.stats().shown;
      ++views;
    }
  }
  CHECK(gain / views >= 3);
  CHECK(2 * drawn < shown);
}

TEST_CASE(
    "lod photo: where Gaussians are large direct rendering is good, and no cut makes levels of detail "
    "worse") {
  GaussianCloud cloud = random_cloud(
      12, {.count = 1500, .sh_degree = 1, .needle = 0, .scale = 0.5, .center = {0, 0, 4}, .extent = 2});
  sort_spatially(cloud);
  OpenMPBackend backend;
  const LodTree tree = build_lod(backend, cloud).value();
  RenderConfig config;
  config.outputs = kRgb;
  // Both are drawn with the quality of the profile `lod`: only the cut and its filter differ.
  config = lod_config(config);
  BasicRenderer<float, OpenMPBackend> renderer(backend, config), lods(backend, config);
  LodCut cut(tree, cloud);
  const GaussianSet whole = cloud.set();
  for (const double x : {-1.0, 0.0, 0.7}) {
    const Camera camera = Camera::look_at({x, 0.2, 0}, {0, 0, 4}, {0, -1, 0}, 64, 64, 50);
    const auto truth = eval::oracle_photo(backend, std::span(&whole, 1), camera, 4).value();
    const auto direct = renderer.render(whole, camera).value();
    const auto sets = cut.select(camera);
    lods.set_config(config);
    const auto lod = lods.render(sets, std::span(&camera, 1)).value();
    const double before = image_error(truth.rgb, direct.rgb, 3).psnr,
                 after = image_error(truth.rgb, lod.rgb, 3).psnr;
    MESSAGE("direct " << before << " dB, lod " << after << " dB");
    CHECK(before > 45);
    CHECK(after >= before);
    CHECK(after > 65);  // the budget of `fast`, whose quality this is
  }
}
