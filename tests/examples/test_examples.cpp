// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "gsnav/demo.hpp"
#include "gsnav/io.hpp"
#include "gsnav/nav.hpp"
#include "io/gltf_builder.hpp"
#include "support/command.hpp"
#include "support/files.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A PNG of the given size that shows something: at least `share` of its pixels are not black.
void check_picture(const std::filesystem::path& path, int width, int height, double share) {
  CAPTURE(path.string());
  const auto loaded = io::load_png(path);
  REQUIRE(loaded.ok());
  CHECK(loaded->width == width);
  CHECK(loaded->height == height);
  std::size_t lit = 0;
  const std::size_t pixels = loaded->samples.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto* const p = &loaded->samples[3 * i];
    lit += p[0] + p[1] + p[2] > 0 ? 1 : 0;
  }
  CHECK(static_cast<double>(lit) > share * static_cast<double>(pixels));
}

/// A column of 1.8 x 0.3 x 0.3 m that bends at its middle and has a clip of that.
TestGltf column() {
  TestGltf g;
  std::vector<float> positions, weights;
  std::vector<std::uint8_t> joints;
  std::vector<std::uint16_t> triangles;
  constexpr int kRings = 7;
  for (int ring = 0; ring < kRings; ++ring) {
    const float y = 0.3f * static_cast<float>(ring), upper = y > 0.9f ? 1.0f : 0.0f;
    for (int k = 0; k < 4; ++k) {
      positions.insert(positions.end(), {k == 1 || k == 2 ? 0.15f : -0.15f, y, k >= 2 ? 0.15f : -0.15f});
      weights.insert(weights.end(), {1 - upper, upper, 0, 0});
      joints.insert(joints.end(), {0, 1, 0, 0});
      const int n = (k + 1) % 4, at = 4 * ring;
      if (ring + 1 == kRings) continue;
      for (const int corner : {k, k + 4, n, n, k + 4, n + 4})
        triangles.push_back(static_cast<std::uint16_t>(at + corner));
    }
  }
  const json attributes = {{"POSITION", g.add(positions, "VEC3", 5126)},
                           {"JOINTS_0", g.add(joints, "VEC4", 5121)},
                           {"WEIGHTS_0", g.add(weights, "VEC4", 5126)}};
  g.doc["meshes"].push_back(
      {{"primitives",
        json::array({{{"attributes", attributes}, {"indices", g.add(triangles, "SCALAR", 5123)}}})}});
  const std::size_t binds = g.add(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,     0, 1,
                                                     1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -0.9f, 0, 1},
                                  "MAT4", 5126);
  g.doc["skins"].push_back({{"joints", {0, 1}}, {"inverseBindMatrices", binds}});
  g.doc["nodes"] = json::array({{{"name", "foot"}, {"children", {1}}},
                                {{"name", "back"}, {"translation", {0, 0.9, 0}}},
                                {{"mesh", 0}, {"skin", 0}}});
  const std::size_t times = g.add(std::vector<float>{0, 1}, "SCALAR", 5126),
                    turns = g.add(std::vector<float>{0, 0, 0, 1, 0.6f, 0, 0, 0.8f}, "VEC4", 5126);
  g.doc["animations"] = json::array(
      {{{"channels", json::array({{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}}})},
        {"samplers", json::array({{{"input", times}, {"output", turns}}})}}});
  g.doc.erase("scenes");
  return g;
}

}  // namespace

TEST_CASE("render_scan: a scan becomes an image and a depth map") {
  const TempFolder folder("example_render_scan");
  io::save_scene(folder / "flat.ply", make_default_scene(0.05).value().cloud).throw_if_error();
  const Outcome made = run_command(EXAMPLE_RENDER_SCAN, "flat.ply cpu", folder.path());
  INFO(made.text);
  REQUIRE(made.ok);
  check_picture(folder / "rgb.png", 640, 480, 0.2);
  check_picture(folder / "depth.png", 640, 480, 0.2);
  const Outcome missing = run_command(EXAMPLE_RENDER_SCAN, "no_such.ply", folder.path());
  CHECK_FALSE(missing.ok);
  CHECK(missing.says("no_such.ply"));
  CHECK(run_command(EXAMPLE_RENDER_SCAN, "flat.ply gpu", folder.path()).says("serial"));
}

TEST_CASE("navmesh_from_scan: area, path and map agree with the triangles of the same flat") {
  const TempFolder folder("example_navmesh_from_scan");
  const DefaultScene flat = make_default_scene(0.3).value();
  io::save_scene(folder / "flat.ply", flat.cloud).throw_if_error();
  const Outcome made = run_command(EXAMPLE_NAVMESH_FROM_SCAN, "flat.ply", folder.path());
  INFO(made.text);
  REQUIRE(made.ok);
  NavMeshSettings settings = gaussian_navmesh_settings();
  settings.agent_radius = 0.2;
  const NavMesh truth = NavMesh::build(settings, flat.vertices, flat.triangles).value();
  const NavMesh mesh = load_navmesh(folder / "scan.navmesh").value();
  CHECK(mesh.settings().agent_radius == doctest::Approx(0.2));
  CHECK(mesh.island_area(0) == doctest::Approx(truth.island_area(0)).epsilon(0.1));

  // No path is shorter than the straight line, or than the shortest path in the rooms themselves by more
  // than the cells that the two NavMeshes may differ by at each corner.
  std::vector<Vec3d> points;
  double length = 0;
  for (std::size_t at = made.text.find('('); at != std::string::npos; at = made.text.find('(', at + 1)) {
    Vec3d p;
    REQUIRE(std::sscanf(made.text.c_str() + at, "(%lf, %lf, %lf)", &p.x, &p.y, &p.z) == 3);
    points.push_back(p);
  }
  REQUIRE(points.size() >= 2);
  REQUIRE(std::sscanf(made.text.c_str() + made.text.find("length"), "length %lf", &length) == 1);
  CHECK(length >= norm(points.back() - points.front()) - 0.01);
  CHECK(length == doctest::Approx(truth.geodesic_distance(points.front(), points.back())).epsilon(0.1));

  // A white pixel is a cell of 0.05 m of the largest island.
  const auto map = io::load_png(folder / "map.png").value();
  std::size_t white = 0;
  for (std::size_t i = 0; i < map.samples.size(); i += 3) white += map.samples[i] == 255 ? 1 : 0;
  CHECK(static_cast<double>(white) * 0.05 * 0.05 == doctest::Approx(mesh.island_area(0)).epsilon(0.02));
}

TEST_CASE("one_kernel: numbers of closed forms") {
  const TempFolder folder("example_one_kernel");
  const Outcome made = run_command(EXAMPLE_ONE_KERNEL, "", folder.path());
  REQUIRE(made.ok);
  double color[3], way = 0, mean[3], w = 0, z = 0;
  int hit = 0;
  REQUIRE(std::sscanf(made.text.c_str(),
                      "color %lf %lf %lf\nhit %d after %lf m\nmean %lf %lf %lf, turned by quaternion "
                      "%lf 0 0 %lf",
                      &color[0], &color[1], &color[2], &hit, &way, &mean[0], &mean[1], &mean[2], &w,
                      &z) == 10);
  constexpr double kPi = 3.14159265358979323846;
  const double base = 0.5 + 1 / (2 * std::sqrt(kPi)), along = std::sqrt(3 / (4 * kPi)) * 0.5;
  CHECK(color[0] == doctest::Approx(base + along).epsilon(1e-4));
  CHECK(color[1] == doctest::Approx(base).epsilon(1e-4));
  CHECK(color[2] == doctest::Approx(base - along).epsilon(1e-4));
  // The pillar's axis is 1 m away; the radii are 0.2 and 0.3 m.
  CHECK(hit == 1);
  CHECK(way == doctest::Approx(0.5).epsilon(1e-3));
  // The mean of the place and of the same place turned by 90 degrees; half of the turn.
  CHECK(mean[0] == doctest::Approx(0.5).epsilon(1e-4));
  CHECK(mean[1] == doctest::Approx(0.5).epsilon(1e-4));
  CHECK(mean[2] == 0.0);
  CHECK(w == doctest::Approx(std::cos(kPi / 8)).epsilon(1e-4));
  CHECK(z == doctest::Approx(std::sin(kPi / 8)).epsilon(1e-4));
}

TEST_CASE("custom_backend: a toy backend has the serial backend's bits") {
  const TempFolder folder("example_custom_backend");
  const Outcome made = run_command(EXAMPLE_CUSTOM_BACKEND, "", folder.path());
  CHECK(made.ok);
  CHECK(made.says("the same bits"));
}

TEST_CASE("pointnav: three episodes end") {
  const TempFolder folder("example_pointnav");
  const Outcome made = run_command(EXAMPLE_POINTNAV, "", folder.path());
  INFO(made.text);
  CHECK(made.ok);
  CHECK(std::count(made.text.begin(), made.text.end(), '\n') == 3);
  CHECK(made.says("success 1"));
  const Outcome wrong = run_command(EXAMPLE_POINTNAV, "abacus", folder.path());
  CHECK_FALSE(wrong.ok);
  CHECK(wrong.says("abacus"));
  CHECK_FALSE(wrong.says("terminate"));
}

TEST_CASE("pointnav_batch: episodes of sixteen environments end") {
  const TempFolder folder("example_pointnav_batch");
  const Outcome made = run_command(EXAMPLE_POINTNAV_BATCH, "", folder.path());
  INFO(made.text);
  CHECK(made.ok);
  CHECK(made.says("episodes, SR"));
}

TEST_CASE("people: a sequence in which somebody moves") {
  const TempFolder folder("example_people");
  const Outcome made = run_command(EXAMPLE_PEOPLE, "cpu", folder.path());
  INFO(made.text);
  REQUIRE(made.ok);
  for (int k = 0; k < 8; ++k)
    check_picture(folder / ("people_" + std::to_string(k) + ".png"), 320, 240, 0.9);
  CHECK(made.says("people_7.png: people at ("));
  CHECK(io::load_png(folder / "people_0.png")->samples !=
        io::load_png(folder / "people_7.png")->samples);
}

TEST_CASE("avatar_from_gltf: a rigged mesh becomes an avatar that moves") {
  const TempFolder folder("example_avatar");
  column().write(folder / "column.glb");
  const Outcome made = run_command(EXAMPLE_AVATAR_FROM_GLTF, "column.glb cpu", folder.path());
  INFO(made.text);
  REQUIRE(made.ok);
  CHECK(made.says("2 joints"));
  check_picture(folder / "avatar.png", 240, 320, 0.02);
  const auto avatar = io::load_avatar(folder / "avatar.npz");
  REQUIRE(avatar.ok());
  CHECK_FALSE(avatar->asset.capsules.empty());
  double highest = 0;
  for (std::size_t i = 0; i < avatar->asset.cloud.size(); ++i)
    highest = std::max(highest, avatar->asset.cloud.mean(i).y);
  CHECK(highest == doctest::Approx(1.8).epsilon(0.01));
  CHECK(run_command(EXAMPLE_AVATAR_FROM_GLTF, "none.glb", folder.path()).says("none.glb"));
}

TEST_CASE("on_gpu: images stay where they are drawn") {
  const TempFolder folder("example_on_gpu");
  const Outcome gpu = run_command(EXAMPLE_ON_GPU, "", folder.path());
  INFO(gpu.text);
  if (gpu.says("skipped: ")) {
    MESSAGE("no GPU here: " << gpu.text);
  } else {
    CHECK(gpu.ok);
    CHECK(gpu.says("16 images, in the device's memory"));
  }
  const Outcome cpu = run_command(EXAMPLE_ON_GPU, "cpu", folder.path());
  CHECK(cpu.ok);
  CHECK(cpu.says("16 images, in host memory"));
}

TEST_CASE("view_cells: what is not seen is not drawn, and hardly missed") {
  const TempFolder folder("example_view_cells");
  const Outcome made = run_command(EXAMPLE_VIEW_CELLS, "", folder.path());
  INFO(made.text);
  CHECK(made.ok);
  std::size_t lines = 0;
  for (std::size_t at = 0; at < made.text.size(); at = made.text.find('\n', at) + 1, ++lines) {
    double share = 0, psnr = 0;
    REQUIRE(std::sscanf(made.text.c_str() + at,
                        "%*[a-z]: %lf %% of the Gaussians drawn, PSNR %lf dB against all", &share,
                        &psnr) == 2);
    CHECK(share > 1);
    CHECK(share < 95);
    CHECK(psnr > 40);
  }
  CHECK(lines == default_scene_views().size());
}
