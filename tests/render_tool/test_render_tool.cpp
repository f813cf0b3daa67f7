// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <cmath>
#include <string>

#include "gsnav/core/rng.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/io/image_file.hpp"
#include "support/command.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Outcome run(const TempFolder& folder, const std::string& arguments) {
  return run_command(GSNAV_RENDER, arguments, folder.path());
}

/// A red ground of flat Gaussians with blue posts on it, z up.
GaussianCloud field_z_up() {
  GaussianCloudBuilder builder(0);
  Rng rng(31);
  for (int i = 0; i < 8000; ++i) {
    const bool ground = i % 2 == 0;
    RawGaussian g;
    g.mean = {rng.uniform(-10, 10), rng.uniform(-10, 10), 0};
    if (!ground)
      g.mean = {2.5 * std::floor(rng.uniform(-4, 4)) + 1.25, 2.5 * std::floor(rng.uniform(-4, 4)) + 1.25,
                rng.uniform(0, 3)};
    g.quat = {1, 0, 0, 0};
    g.log_scales = ground ? Vec3d{-1.5, -1.5, -5} : Vec3d{-3, -3, -1.5};
    g.opacity_logit = 6;
    g.sh0 = ground ? std::array<float, 3>{1.7f, -1.7f, -1.7f} : std::array<float, 3>{-1.7f, -1.7f, 1.7f};
    builder.add(g);
  }
  return builder.cloud();
}

}  // namespace

TEST_CASE("render tool: without cameras, views around the scene with its own ground below") {
  const TempFolder folder("render_orbit");
  REQUIRE(io::save_ply(folder / "a.ply", field_z_up()).ok());
  const Outcome out = run(folder, "--scene a.ply --out o --width 96 --height 64 --orbit 3 --png");
  CAPTURE(out.text);
  REQUIRE(out.ok);
  CHECK(out.says("up: +z, seen from the ground"));
  for (const char* name : {"o/0000.rgb.png", "o/0001.rgb.png", "o/0002.rgb.png"}) {
    CAPTURE(name);
    const io::PngImage image = io::load_png(folder / name).value();
    REQUIRE(image.width == 96);
    // The horizon is level: nothing above, ground below, blue posts above the middle of the ground.
    double upper = 0, lower = 0;
    for (int x = 0; x < 96; ++x) {
      for (int y = 0; y < 64; ++y) {
        const auto at = static_cast<std::size_t>(3 * (y * 96 + x));
        (y < 32 ? upper : lower) += image.samples[at];
      }
    }
    CHECK(lower > 2 * upper);
    double left = 0, right = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 96; ++x)
        (x < 48 ? left : right) += image.samples[static_cast<std::size_t>(3 * (y * 96 + x))];
    }
    CHECK(left == doctest::Approx(right).epsilon(0.2));
  }
}

TEST_CASE("render tool: a folder that cannot be is said before the scene is read") {
  const TempFolder folder("render_out");
  write_file(folder / "file", "x");
  const Outcome out = run(folder, "--scene absent.ply --out file/in");
  CHECK_FALSE(out.ok);
  CHECK(out.says("--out file/in: the folder cannot be made"));
  CHECK_FALSE(out.says("absent.ply"));
}

TEST_CASE("render tool: control characters of a name do not reach the terminal") {
  const TempFolder folder("render_name");
  const Outcome out = run(folder, "--scene \"$(printf 'a\\033]0;title\\007.ply')\" --out o");
  CHECK_FALSE(out.ok);
  CHECK(out.text.find('\033') == std::string::npos);
  CHECK(out.says("a\\x1B]0;title\\x07.ply"));
}
