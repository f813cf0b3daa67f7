// SPDX-License-Identifier: Apache-2.0
// Meshes in batches of the GPU against one camera at a time; that one against the CPU and oracles:
// tests/hard_cases/test_composite.cpp.
#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "ops/mesh_images.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/scene/spatial_order.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"

namespace {

using namespace gsnav;
using namespace gsnav_test;

/// A sphere among the Gaussians of `random_cloud`, and a wall through them.
struct Meshes {
  explicit Meshes(CudaBackend& cuda) {
    SurfaceMesh wall = quad({-3, -3, 4.2f}, {3, -3, 4.6f}, {3, 3, 4.6f}, {-3, 3, 4.2f});
    wall.colors = {{1, 0, 0}, {0, 1, 0}, {0.5f, 0.5f, 1}, {1, 1, 1}};
    wall.two_sided = true;
    scene.add(sphere(0.7, 60, 30)).value();
    scene.add(wall).value();
    for (std::size_t i = 0; i < 2; ++i) arrays.emplace_back(cuda, scene.instance(i, {}, 0).mesh);
    both = {arrays[0].instance({{0.8, 0.6, 0, 0}, {0.2, 0.1, 3.6}, 1.3}, 0), arrays[1].instance({}, 1)};
    moved = {arrays[0].instance({{1, 0, 0, 0}, {-0.5, -0.2, 3}, 0.6}, 0)};
  }
  MeshScene scene;
  std::vector<MeshArrays<CudaBackend>> arrays;
  std::vector<MeshInstance> both, moved;
};

}  // namespace

TEST_CASE("cuda batch: meshes among the Gaussians have the bits they have one camera at a time") {
  if (no_gpu("cuda batches with meshes")) return;
  CudaBackend cuda;
  GaussianCloud cloud = random_cloud(5, {.count = 9000, .needle = 0.3});
  sort_spatially(cloud);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<GaussianSet> sets{arrays.set()};
  const Meshes meshes(cuda);
  MeshLight lit;
  lit.unlit = false;
  for (const std::array<int, 3>& size : {std::array{5, 149, 101}, std::array{60, 149, 101}, std::array{2, 640, 352}}) {
    const int count = size[0];
    const std::vector<Camera> cameras = ring(count, size[1], size[2]);
    for (const bool all : {true, false}) {
      std::vector<MeshFrame> seen;
      for (int c = 0; c < count; ++c) {
        if (c % 3 == 0 || all) {
          seen.push_back({meshes.both, c % 2 == 0 ? lit : MeshLight{}});
        } else {
          seen.push_back(c % 3 == 1 ? MeshFrame{meshes.moved} : MeshFrame{});
        }
      }
      RenderConfig config;
      config.background = {0.25, 0.5, 0.75};
      config.profile = all ? Profile::fast : Profile::exact;
      if (count == 5) config.blend_space = ColorSpace::linear;
      GaussianSet set = sets[0];
      set.color_space = config.blend_space;
      CudaBatchRenderer renderer(cuda, config);
      for (const unsigned outputs : {unsigned{kRgb}, unsigned{kMedianDepth}, unsigned{kAlpha}, kMedianOnly, kAll}) {
        CAPTURE(count);
        CAPTURE(all);
        CAPTURE(outputs);
        const Batch got = draw_batch(cuda, renderer, {set}, cameras, {}, outputs, outputs == kMedianOnly, seen);
        const Frames<float> expected = singly(cuda, {set}, cameras, {}, config, outputs, seen);
        check_same(got.frames, expected);
        CHECK(got.stats.meshes.drawn > 1000);
        if (outputs != kMedianOnly) continue;
        std::size_t closed = 0;
        for (const float a : got.frames.alpha) closed += a == 1.0f ? 1 : 0;
        CHECK(closed > 1000);
      }
    }
  }
}

TEST_CASE("cuda batch: meshes alone, meshes that come and go, and rules that batches do not know") {
  if (no_gpu("cuda batches of meshes alone")) return;
  CudaBackend cuda;
  const GaussianArrays<CudaBackend> arrays(cuda, random_cloud(6, {.count = 2000}));
  const Meshes meshes(cuda);
  const std::vector<Camera> cameras = ring(3, 97, 64);
  CudaBatchRenderer renderer(cuda);
  const std::vector<MeshFrame> all(3, MeshFrame{meshes.both});
  const Batch alone = draw_batch(cuda, renderer, {}, cameras, {}, kMedianOnly, true, all);
  check_same(alone.frames, singly(cuda, {}, cameras, {}, {}, kMedianOnly, all));
  const Batch without = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kAll);
  check_same(without.frames, singly(cuda, {arrays.set()}, cameras, {}, {}, kAll));
  CHECK(without.stats.meshes.triangles == 0);
  for (int i = 0; i < 4; ++i) {
    const Batch again = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kAll, true, all);
    check_same(again.frames, singly(cuda, {arrays.set()}, cameras, {}, {}, kAll, all));
  }
  for (const int rule : {0, 1, 2}) {
    RenderConfig config;
    if (rule == 0) config.composite = Composite::hard_depth;
    if (rule == 1) config.response = Response::ray;
    if (rule == 2) config.compat = Compat::inria;
    CudaBatchRenderer other(cuda, config);
    Buffer<float, CudaBackend> rgb(cuda);
    rgb.resize_discard(3 * 97 * 64);
    BatchImages to;
    to.floats.rgb = rgb.data();
    const std::vector<GaussianSet> sets{arrays.set()};
    const std::vector<BatchCamera> one{{cameras[0], {}, all[0]}};
    const Status s = other.render(sets, one, to);
    CHECK(s.code() == Errc::unsupported);
    CHECK(s.message().find("cameras[0]: meshes") != std::string::npos);
  }
}
#endif
