// SPDX-License-Identifier: Apache-2.0
// The program as people run it.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "gsnav/backends/serial.hpp"
#include "gsnav/core/rng.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/scene/views_around.hpp"
#include "gsnav/io/image_file.hpp"
#include "gsnav/io/scene_file.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "support/command.hpp"
#include "support/compiled_frames.hpp"
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
  write_file(folder / "none.json", "[]");
  const Outcome none = run(folder, "--scene a.ply --out n --cameras none.json");
  CHECK_FALSE(none.ok);
  CHECK(none.says("none.json: has no cameras"));
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

TEST_CASE(
    "render tool: without its scene it makes no folder, and a folder that cannot be made comes first") {
  const TempFolder folder("render_no_scene");
  const Outcome missing = run(folder, "--scene none.ply --out o/p");
  CHECK_FALSE(missing.ok);
  CHECK(missing.says("none.ply"));
  CHECK_FALSE(std::filesystem::exists(folder / "o"));
  write_file(folder / "file", "");
  const Outcome refused = run(folder, "--scene none.ply --out file/p");
  CHECK_FALSE(refused.ok);
  CHECK(refused.says("--out file/p: the folder cannot be made"));
  CHECK_FALSE(refused.says("none.ply"));
  const Outcome made =
      run(folder, "default --density 0.05 --orbit 1 --width 32 --height 32 --png --out o/p");
  CAPTURE(made.text);
  CHECK(made.ok);
  CHECK(std::filesystem::exists(folder / "o/p/0000.rgb.png"));
}

TEST_CASE("render tool: the first line names the device and the instruction set in use") {
  const TempFolder folder("render_says_device");
  const char* const arguments = "default --density 0.05 --orbit 1 --width 32 --height 32 --png --out o";
  const auto said = [&](const std::string& device, const char* limit) {
    if (limit != nullptr) ::setenv("GSNAV_ISA", limit, 1);
    const Outcome out = run(folder, arguments + (" --device " + device));
    ::unsetenv("GSNAV_ISA");
    CAPTURE(out.text);
    REQUIRE(out.ok);
    return out.text.substr(0, out.text.find('\n'));
  };
  CHECK(said("serial", nullptr) == "device: CPU, 1 thread, portable code");
#if defined(__x86_64__) && !defined(__FMA__) && defined(_OPENMP)
  const std::string slow = said("cpu:2", "baseline");
  CHECK(slow.starts_with("device: CPU, 2 threads, SSE2 (no FMA: a frame takes "));
  CHECK(slow.find(" times as long") != std::string::npos);
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2) CHECK(said("cpu:1", "avx2") == "device: CPU, 1 thread, AVX2");
#endif
}

TEST_CASE("render tool: any device draws the same bits, and serial64 those of the float64 reference") {
  const TempFolder folder("render_device");
  REQUIRE(io::save_ply(folder / "a.ply", field_z_up()).ok());
  write_file(folder / "m.obj", "v -1 -1 1\nv 1 -1 1\nv 0 1 2\nf 1 2 3\n");
  const auto draw = [&](const std::string& device, const std::string& more) {
    const Outcome out = run(folder, "--scene a.ply --out " + device +
                                        " --orbit 2 --width 48 --height 32 --npy --ledger --device " +
                                        device + " " + more);
    CAPTURE(out.text);
    REQUIRE(out.ok);
    CHECK(out.says("camera 1:\nskipped: "));
    return read_file(folder / (device + "/0001.rgb.npy")) +
           read_file(folder / (device + "/0001.depth.npy"));
  };
  std::string plain;
  for (const char* more : {"", "--storage packed --profile fast", "--profile lod --lod-error 8",
                           "--mesh m.obj", "--mesh m.obj --composite hard_depth"}) {
    CAPTURE(more);
    const std::string serial = draw("serial", more);
    CHECK(serial == draw("cpu:2", more));
    CHECK(serial != draw("serial64", more));
    CHECK(serial != plain);
    if (plain.empty()) plain = serial;
  }
  // As the library draws what it reads.
  static_cast<void>(draw("serial64", "--up keep"));
  const auto read = io::load_scene(folder / "a.ply").value();
  std::vector<Camera> cameras = views_around(read.cloud, read.report.up, 2, 48, 32);
  cameras[1].near_plane = 0.2;
  SerialBackend backend;
  const auto want =
      BasicRenderer<double, SerialBackend>(backend).render(read.cloud.set(), cameras[1]).value();
  const std::vector<float> rgb(want.rgb.begin(), want.rgb.end());
  REQUIRE(io::save_npy(folder / "want.npy", rgb, std::vector<std::size_t>{32, 48, 3}).ok());
  CHECK(read_file(folder / "serial64/0001.rgb.npy") == read_file(folder / "want.npy"));

  const Outcome none = run(folder, "--scene absent.ply --out o --device gpu");
  CHECK_FALSE(none.ok);
  CHECK(none.says("--device: device \"gpu\": must be best, cpu"));
  CHECK(none.says("there are: serial"));
}

TEST_CASE("render tool: a folder that cannot be is said before the scene is read") {
  const TempFolder folder("render_out");
  write_file(folder / "file", "x");
  const Outcome out = run(folder, "--scene absent.ply --out file/in");
  CHECK_FALSE(out.ok);
  CHECK(out.says("--out file/in: the folder cannot be made"));
  CHECK_FALSE(out.says("absent.ply"));

  const Outcome cameras = run(folder, "--scene absent.ply --cameras none.json --out views");
  CHECK(cameras.says("none.json"));
  CHECK_FALSE(cameras.says("absent.ply"));
}

TEST_CASE("render tool: cameras that cannot be made are said, and --orbit holds for every scene") {
  const TempFolder folder("render_nothing");
  write_file(folder / "empty.obj", "");
  CHECK(run(folder, "--scene empty.obj --out o").says("nothing to look at"));
  const Outcome one =
      run(folder, "default --density 0.05 --orbit 1 --width 32 --height 32 --png --out one");
  CHECK(one.says("1/1 views"));
  CHECK(run(folder, "--eye nan 0 0 --target 1 0 0 --out o").says("--eye: nan: must be finite"));
  CHECK(run(folder, "--eye 0 0 0 --target 1 0 inf --out o").says("--target: inf: must be finite"));
}

TEST_CASE("render tool: control characters of a name do not reach the terminal") {
  const TempFolder folder("render_name");
  const Outcome out = run(folder, "--scene \"$(printf 'a\\033]0;title\\007.ply')\" --out o");
  CHECK_FALSE(out.ok);
  CHECK(out.text.find('\033') == std::string::npos);
  CHECK(out.says("a\\x1B]0;title\\x07.ply"));
}
