// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "gsnav/detail/scene/placed_meshes.hpp"
#include "ops/mesh_images.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_test;

Camera lens(int size, double f) { return mesh_lens(size, size, f); }

double encoded(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

std::vector<std::uint8_t> rgba_of(int width, int height, const auto& texel) {
  std::vector<std::uint8_t> rgba;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const int c : texel(x, y)) rgba.push_back(static_cast<std::uint8_t>(c));
      rgba.push_back(255);
    }
  }
  return rgba;
}

std::shared_ptr<const MeshTexture> texture(int width, int height, const auto& texel) {
  return std::make_shared<const MeshTexture>(MeshTexture::make(static_cast<std::size_t>(width),
                                                               static_cast<std::size_t>(height),
                                                               rgba_of(width, height, texel))
                                                 .value());
}

TEST_CASE("vertex colours are linear in space, not on the screen, and encoded at last") {
  // A floor from 1 m to 9 m: linear red is (z - 1) / 8.
  SurfaceMesh floor = quad({-4, 1, 1}, {4, 1, 1}, {4, 1, 9}, {-4, 1, 9});
  floor.colors = {{0, 1, 0.25f}, {0, 1, 0.25f}, {1, 1, 0.25f}, {1, 1, 0.25f}};
  const OneMesh mesh(floor);
  SerialBackend serial;
  const auto f = draw<float>(serial, mesh.instances, lens(64, 30));
  std::size_t seen = 0;
  for (std::size_t i = 0; i < f.depth.size(); ++i) {
    const double z = 30 / (static_cast<double>(i / 64) + 0.5 - 32);
    if (!(f.depth[i] < 100)) continue;
    ++seen;
    REQUIRE(std::abs(static_cast<double>(f.color[3 * i]) - encoded((z - 1) / 8)) < 2e-5);
    REQUIRE(std::abs(static_cast<double>(f.color[3 * i + 1]) - 1) < 1e-6);
    REQUIRE(std::abs(static_cast<double>(f.color[3 * i + 2]) - encoded(0.25)) < 1e-6);
  }
  CHECK(seen > 1000);
}

TEST_CASE("a base colour in a byte comes back as that byte") {
  SerialBackend serial;
  for (int byte = 0; byte < 256; ++byte) {
    SurfaceMesh wall = quad({-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, 1});
    const float v = srgb_decoded(static_cast<std::uint8_t>(byte));
    wall.base_color = {v, v, v};
    CHECK(std::abs(draw<float>(serial, OneMesh(wall).instances, lens(4, 4)).color[0] * 255 -
                   static_cast<float>(byte)) < 1e-3f);
  }
}

TEST_CASE("textures: perspective-correct, texel centres, repetition") {
  // A wall across the view: pixel (x, y) is texel (x, y) of a picture that repeats.
  const auto value = [](int x, int y) { return std::vector<int>{16 * x, 32 * y, 255 - 16 * x}; };
  SurfaceMesh wall = quad({-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1});
  wall.texture = texture(16, 8, value);
  wall.uvs = {{0, 0}, {2, 0}, {2, 4}, {0, 4}};
  SerialBackend serial;
  const auto f = draw<float>(serial, OneMesh(wall).instances, lens(32, 16));
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      const auto expected = value(x % 16, y % 8);
      for (std::size_t c = 0; c < 3; ++c) {
        const double got =
            255 * static_cast<double>(f.color[3 * static_cast<std::size_t>(y * 32 + x) + c]);
        CAPTURE(x);
        CAPTURE(y);
        REQUIRE(std::abs(got - expected[c]) < 0.02);
      }
    }
  }
  // The floor again: u runs with depth, and red with u within the picture.
  SurfaceMesh floor = quad({-4, 1, 1}, {4, 1, 1}, {4, 1, 9}, {-4, 1, 9});
  floor.texture = texture(256, 1, [](int x, int) { return std::vector<int>{x, x, x}; });
  floor.uvs = {{0.25f, 0}, {0.25f, 0}, {0.75f, 0}, {0.75f, 0}};
  const auto g = draw<double>(serial, OneMesh(floor).instances, lens(64, 30));
  for (std::size_t i = 0; i < g.depth.size(); ++i) {
    const double z = 30 / (static_cast<double>(i / 64) + 0.5 - 32);
    // Mipmaps of a ramp are the ramp, but for its curvature in linear light and a shift of a texel of
    // theirs.
    if (g.depth[i] < 5)
      REQUIRE(std::abs(255 * g.color[3 * i] - (256 * (0.25 + (z - 1) / 16) - 0.5)) < 1.5);
  }
}

TEST_CASE("mipmaps: a far checkerboard is its mean in linear light") {
  SurfaceMesh wall = quad({-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1});
  wall.texture = texture(64, 64, [](int x, int y) {
    const int v = (x + y) % 2 * 255;
    return std::vector<int>{v, v, v};
  });
  wall.uvs = {{0, 0}, {50, 0}, {50, 50}, {0, 50}};
  SerialBackend serial;
  const auto f = draw<float>(serial, OneMesh(wall).instances, lens(32, 16));
  for (const float c : f.color)
    REQUIRE(std::abs(static_cast<double>(c) - encoded(0.5)) < 2e-3);  // a byte's half
  // Odd sizes keep their mean too: 3 x 5, one white column of three.
  wall.texture = texture(3, 5, [](int x, int) {
    const int v = x == 1 ? 255 : 0;
    return std::vector<int>{v, v, v};
  });
  const auto g = draw<float>(serial, OneMesh(wall).instances, lens(32, 16));
  for (const float c : g.color) REQUIRE(std::abs(static_cast<double>(c) - encoded(1.0 / 3)) < 4e-3);
}

TEST_CASE("light: ambient and one direction, on the side that is seen") {
  SurfaceMesh wall = quad({-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1});
  wall.base_color = {0.5f, 0.25f, 1};
  const OneMesh mesh(wall);
  MeshLight light;
  light.unlit = false;
  light.ambient = {0.1, 0.2, 0.3};
  light.diffuse = {0.6, 0.5, 0.4};
  light.direction = {0, 3, -4};  // from before the wall
  SerialBackend serial;
  const auto f = draw<double>(serial, mesh.instances, lens(8, 4), light);
  CHECK(f.color[0] == doctest::Approx(encoded(0.5 * (0.1 + 0.6 * 0.8))).epsilon(1e-7));
  CHECK(f.color[1] == doctest::Approx(encoded(0.25 * (0.2 + 0.5 * 0.8))).epsilon(1e-7));
  light.direction = {0, 0, 1};  // from behind
  CHECK(draw<double>(serial, mesh.instances, lens(8, 4), light).color[2] ==
        doctest::Approx(encoded(0.3)).epsilon(1e-7));
}

TEST_CASE("what does not fit is named") {
  MeshScene scene;
  SurfaceMesh m = quad({0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1});
  m.geometry.triangles.push_back({0, 1, 4});
  CHECK(scene.add(m).status().message().find("triangle 2 has vertex 4 of 4") != std::string::npos);
  m.geometry.triangles.pop_back();
  m.colors.resize(3);
  CHECK(scene.add(m).status().message().find("colors: 3 for 4") != std::string::npos);
  CHECK(scene.size() == 0);
  CHECK(!MeshTexture::make(2, 2, std::vector<std::uint8_t>(15)));
  MeshInstance instance;
  instance.world_from_mesh.scale = 0;
  CHECK(validate(instance).message().find("world_from_mesh") != std::string::npos);
}

}  // namespace

TEST_CASE(
    "a surface as files give it: parts share textures, stand in several places, and are lit or not") {
  TexturedScene scene;
  scene.textures.push_back({4, 1, rgba_of(4, 1, [](int x, int) {
                              return std::vector<int>{60 * x, 200, 10};
                            })});
  for (int part = 0; part < 2; ++part) {
    TexturedPart p;
    p.geometry = quad({-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}).geometry;
    p.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    p.material.texture = 0;
    p.material.double_sided = true;
    p.material.unlit = part == 1;
    scene.parts.push_back(p);
  }
  // Two of the first part beside each other, one of the other above.
  for (const Vec3d& at : {Vec3d{-0.5, 0.5, 2}, Vec3d{0.5, 0.5, 2}, Vec3d{0, -0.5, 2}}) {
    scene.instances.push_back(
        {scene.instances.size() == 2 ? std::size_t{1} : std::size_t{0}, {{}, at, 1}});
  }
  const PlacedMeshes placed = placed_meshes(scene).value();
  CHECK(placed.meshes.size() == 2);
  CHECK(placed.meshes.mesh(0).texture == placed.meshes.mesh(1).texture);
  CHECK(placed.warnings.empty());
  // 16 pixels a metre at 2 m: each place is 16 pixels wide, a texel four.
  MeshLight dark;
  dark.unlit = false;
  dark.ambient = {0, 0, 0};
  dark.diffuse = {0, 0, 0};
  SerialBackend serial;
  const auto plain = draw<float>(serial, placed.in_world(), lens(32, 32));
  const auto lit = draw<float>(serial, placed.in_world(), lens(32, 32), dark);
  const auto red = [](const auto& f, int x, int y) {
    return f.color[3 * static_cast<std::size_t>(y * 32 + x)] * 255;
  };
  for (int texel = 0; texel < 4; ++texel) {
    for (const int left : {0, 16}) {
      CHECK(std::abs(red(plain, left + 4 * texel + 2, 24) - 60.0f * static_cast<float>(texel)) < 25);
      CHECK(red(lit, left + 4 * texel + 2, 24) == 0);
    }
    CHECK(red(lit, 8 + 4 * texel + 2, 8) == red(plain, 8 + 4 * texel + 2, 8));
  }
  CHECK(red(plain, 8 + 14, 8) > 150);
  CHECK(plain.depth[24 * 32 + 3] == 2.0f);

  TexturedScene bad = scene;
  bad.parts[1].material.texture = 3;
  CHECK(placed_meshes(bad).status().message().find("parts[1]: texture 3 of 1") != std::string::npos);
  bad = scene;
  bad.instances[2].part = 7;
  CHECK(placed_meshes(bad).status().message().find("instances[2]: part 7 of 2") != std::string::npos);
  bad = scene;
  bad.textures[0].width = 5;
  CHECK(placed_meshes(bad).status().message().find("parts[0]: MeshTexture") != std::string::npos);
  bad = scene;
  bad.parts[0].material.alpha = 1.5;
  CHECK(placed_meshes(bad).status().message().find("parts[0]: SurfaceMesh: base_alpha = 1.5") !=
        std::string::npos);
  bad = scene;
  bad.parts[1].alphas = {1, 1};
  CHECK(placed_meshes(bad).status().message().find("parts[1]: SurfaceMesh: alphas: 2 for 4 vertices") !=
        std::string::npos);
  scene.parts[0].material.alpha_cutoff = 0.25;
  scene.parts[1].material.blend = true;
  scene.parts[1].material.alpha = 0.5;
  const PlacedMeshes through = placed_meshes(scene).value();
  CHECK(through.meshes.mesh(0).alpha_mode == MeshAlpha::mask);
  CHECK(through.meshes.mesh(0).alpha_cutoff == 0.25f);
  CHECK(through.meshes.mesh(1).alpha_mode == MeshAlpha::blend);
  CHECK(through.meshes.mesh(1).base_alpha == 0.5f);
  CHECK(through.warnings.empty());
}
