// SPDX-License-Identifier: Apache-2.0
// Meshes on the GPU against the CPU: the same kernels must give the same bits, whatever order triangles
// come in. Frames of both, and their oracles: tests/hard_cases/test_composite.cpp.
#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "ops/mesh_images.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#include "gsnav/core/rng.hpp"
#include "ops/no_gpu.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_test;

std::shared_ptr<const MeshTexture> noise(std::uint64_t seed, std::size_t width, std::size_t height) {
  Rng rng(seed);
  std::vector<std::uint8_t> rgba(4 * width * height);
  for (std::uint8_t& v : rgba) v = static_cast<std::uint8_t>(rng.uniform(0, 256));
  return std::make_shared<const MeshTexture>(MeshTexture::make(width, height, std::move(rgba)).value());
}

void check_same(CudaBackend& cuda, const std::vector<MeshInstance>& meshes, const Camera& camera,
                const MeshLight& light) {
  SerialBackend serial;
  for (const int tile : {8, 16, 32}) {
    const auto cpu = draw<float>(serial, meshes, camera, light, tile),
               gpu = draw<float>(cuda, meshes, camera, light, tile);
    CHECK(gpu.depth == cpu.depth);
    CHECK(gpu.triangle == cpu.triangle);
    CHECK(gpu.instance == cpu.instance);
    CHECK(gpu.tile_far == cpu.tile_far);
    CHECK(gpu.color == cpu.color);
    CHECK(gpu.normal == cpu.normal);
    CHECK(gpu.stats.triangles == cpu.stats.triangles);
    CHECK(gpu.stats.drawn == cpu.stats.drawn);
    CHECK(gpu.stats.not_finite == cpu.stats.not_finite);
  }
}

TEST_CASE("cuda meshes: the bits of the CPU, small triangles and huge ones, clipped and not finite") {
  if (no_gpu("cuda meshes")) return;
  CudaBackend cuda;
  MeshLight lit;
  lit.unlit = false;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    SurfaceMesh soup = random_triangles(seed, seed == 3 ? 20000 : 300);
    if (seed == 2) soup.geometry.vertices[7].y = std::numeric_limits<float>::quiet_NaN();
    MeshScene scene;
    scene.add(std::move(soup)).value();
    scene.add(is_emulated() ? sphere(0.7, 100, 50) : sphere(0.7, 200, 100)).value();
    const std::vector<MeshInstance> both{scene.instance(0, {{0.8, 0.6, 0, 0}, {0.1, 0.2, 0.3}, 1.5}, 3),
                                         scene.instance(1, {{}, {0.5, 0, 2}, 1}, 4)};
    check_same(cuda, both, mesh_lens(97, 61, 50), lit);
    check_same(cuda, both, is_emulated() ? mesh_lens(321, 184, 150) : mesh_lens(641, 367, 300), {});
  }
}

TEST_CASE("cuda meshes: textures and vertex colours, two-sided, of equal depth") {
  if (no_gpu("cuda meshes of textures")) return;
  CudaBackend cuda;
  MeshScene scene;
  SurfaceMesh floor = quad({-4, 1, 0.5f}, {4, 1, 0.5f}, {4, 1, 40}, {-4, 1, 40});
  floor.uvs = {{0, 0}, {9, 0}, {9, 50}, {0, 50}};
  floor.texture = noise(1, 37, 64);
  floor.colors = {{1, 0, 0}, {0, 1, 0}, {0.5f, 0.5f, 1}, {1, 1, 1}};
  scene.add(floor).value();
  floor.texture = noise(2, 1, 5);
  floor.two_sided = true;
  scene.add(floor).value();  // where the first lies: the first is seen
  const std::vector<MeshInstance> all{scene.instance(0, {}, 1), scene.instance(1, {}, 2),
                                      scene.instance(1, {{}, {0, -2, 0}, 1}, 5)};
  check_same(cuda, all, mesh_lens(320, 240, 160), {});
  SerialBackend serial;
  const auto seen = draw<float>(serial, all, mesh_lens(320, 240, 160));
  std::size_t first = 0, second = 0;
  for (const std::uint32_t id : seen.instance) first += id == 1 ? 1 : 0, second += id == 2 ? 1 : 0;
  CHECK(first > 1000);
  CHECK(second == 0);
}

}  // namespace
#endif
