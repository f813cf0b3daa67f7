// SPDX-License-Identifier: Apache-2.0
// The benchmark flat: 300,000 Gaussians, four poses at 256x256, float32 against float64.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "gsnav/demo.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Error in metres below which 99 % of the pixels with alpha over 0.9 lie.
double depth_error_p99(const Frames<float>& f, const Frames<double>& reference) {
  std::vector<double> errors;
  for (std::size_t p = 0; p < f.alpha.size(); ++p) {
    if (reference.alpha[p] > 0.9) {
      errors.push_back(std::abs(static_cast<double>(f.median_depth[p]) - reference.median_depth[p]));
    }
  }
  if (errors.empty()) return 0;
  std::sort(errors.begin(), errors.end());
  return errors[errors.size() * 99 / 100];
}

}  // namespace

TEST_CASE("the benchmark flat at 300K") {
  SceneSampling sampling;
  sampling.gaussians = 300000;
  sampling.sh_degree = 3;
  const DefaultScene flat = make_default_scene(sampling).value();
  IndoorViewOptions views;
  views.count = 64;
  views.width = views.height = 256;
  const std::vector<Camera> cameras = indoor_views(flat, views).value();
  CHECK(flat.cloud.size() == 300000);
  REQUIRE(cameras.size() == 64);
  const std::vector<GaussianSet> sets{flat.cloud.set()};

  SerialBackend serial;
  for (const std::size_t c : {std::size_t{0}, std::size_t{16}, std::size_t{32}, std::size_t{48}}) {
    CAPTURE(c);
    const auto reference = render<double>(serial, sets, cameras[c]);
    const auto check = [&](const Frames<float>& f, double psnr) {
      CHECK(image_error(f.rgb, reference.rgb, 3).psnr >= psnr);
      CHECK(image_error(f.rgb, reference.rgb, 3).p999 <= 1e-4);
      CHECK(image_error(f.alpha, reference.alpha, 1).psnr >= psnr);
      CHECK(depth_error_p99(f, reference) <= 1e-4);
    };
    const auto single = render<float>(serial, sets, cameras[c]);
    check(single, 85);
#if defined(_OPENMP)
    for (const int threads : {1, 2}) {
      OpenMPBackend openmp(threads);
      for (const int tile : {8, 16, 32}) {
        RenderConfig config;
        config.tuning.tile_size = tile;
        const auto f = render<float>(openmp, sets, cameras[c], config);
        CHECK(f.rgb == single.rgb);
        CHECK(f.alpha == single.alpha);
        CHECK(f.median_depth == single.median_depth);
      }
    }
    RenderConfig fast;
    fast.quality = Quality::fast();
    OpenMPBackend openmp(2);
    const auto f = render<float>(openmp, sets, cameras[c], fast);
    const ImageError e = image_error(f.rgb, reference.rgb, 3);
    CHECK(e.psnr >= 65);
    CHECK(e.max <= 6.0 / 255);
#endif
  }
}
