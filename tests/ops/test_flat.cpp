// SPDX-License-Identifier: Apache-2.0
// The benchmark flat: 300,000 Gaussians, four poses at 256x256, float32 against float64.
#include <doctest/doctest.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "ops/backends.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Error in metres below which 99 % of the pixels with alpha over 0.9 lie.
[[maybe_unused]] double depth_error_p99(const Frames<float>& f, const Frames<double>& reference) {
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
#if !defined(GSNAV_BENCH_SCENE_GENERATOR)
  std::printf("SKIP: the generator of the benchmark flat is not there (GSNAV_FLAT_GENERATOR)\n");
#else
  const TempFolder dir("test_flat");
  const std::string ply = (dir / "flat.ply").string(), cameras_path = (dir / "cameras.json").string();
  const std::string generator = GSNAV_BENCH_SCENE_GENERATOR;
  REQUIRE(std::system(("\"" + generator + "\" ply 300000 \"" + ply + "\" 2> /dev/null").c_str()) == 0);
  REQUIRE(std::system(("\"" + generator + "\" cameras 64 256 256 \"" + cameras_path + "\"").c_str()) ==
          0);
  const LoadedCloud loaded = io::load_ply(ply).value();
  const std::vector<Camera> cameras = io::load_cameras(cameras_path).value();
  CHECK(loaded.report.read == 300000);
  REQUIRE(cameras.size() == 64);
  const std::vector<GaussianSet> sets{loaded.cloud.set()};

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
#endif
}
