// SPDX-License-Identifier: Apache-2.0
// Meshes in batches of the GPU against one camera at a time; that one against the CPU and oracles:
// tests/hard_cases/test_composite.cpp.
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "ops/mesh_images.hpp"

#if defined(GSNAV_HAS_CUDA)
#include <cuda_runtime_api.h>

#include "gsnav/detail/scene/spatial_order.hpp"
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
  GaussianCloud cloud = random_cloud(5, {.count = is_emulated() ? 3000 : 9000, .needle = 0.3});
  sort_spatially(cloud);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<GaussianSet> sets{arrays.set()};
  const Meshes meshes(cuda);
  MeshLight lit;
  lit.unlit = false;
  const std::vector<Camera> large = is_emulated() ? ring(2, 160, 112) : ring(2, 640, 352);
  for (const std::vector<Camera>& cameras : {ring_of(5), ring_of(many_cameras()), large}) {
    const int count = static_cast<int>(cameras.size());
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
      config.quality.exponential = all ? Exponential::fast : Exponential::exact;
      if (count == 5) config.blend_space = ColorSpace::linear;
      GaussianSet set = sets[0];
      set.color_space = config.blend_space;
      CudaBatchRenderer renderer(cuda, config);
      for (const unsigned outputs :
           {unsigned{kRgb}, unsigned{kMedianDepth}, unsigned{kAlpha}, kMedianOnly, kAll}) {
        CAPTURE(count);
        CAPTURE(all);
        CAPTURE(outputs);
        if (is_emulated() && count != 5 && outputs != (all ? kAll : kMedianOnly)) continue;
        const Batch got =
            draw_batch(cuda, renderer, {set}, cameras, {}, outputs, outputs == kMedianOnly, seen);
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
  const GaussianCloud scattered = random_cloud(6, {.count = 2000});
  const GaussianArrays<CudaBackend> arrays(cuda, scattered);
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
  for (const bool compat : {false, true}) {
    RenderConfig config;
    if (compat) {
      config.compat = Compat::inria;
    } else {
      config.response = Response::ray;
    }
    CudaBatchRenderer other(cuda, config);
    Buffer<float, CudaBackend> rgb(cuda);
    rgb.resize_discard(3 * 97 * 64);
    BatchImages to;
    to.floats.rgb = rgb.data();
    const std::vector<GaussianSet> sets{arrays.set()};
    const std::vector<BatchCamera> one{{cameras[0], {}, all[0]}};
    CHECK(CudaBatchRenderer::supports(config, sets).ok());
    CHECK(CudaBatchRenderer::supports({}, sets, all[0]).ok());
    CHECK(CudaBatchRenderer::supports(config, sets, all[0]).message().find("RenderConfig.") !=
          std::string::npos);
    const Status s = other.render(sets, one, to);
    CHECK(s.code() == Errc::unsupported);
    CHECK(s.message().find("cameras[0]: meshes") != std::string::npos);
  }
}

TEST_CASE("cuda batch: Composite::hard_depth") {
  if (no_gpu("cuda batches with Composite::hard_depth")) return;
  CudaBackend cuda;
  const GaussianCloud scattered = random_cloud(6, {.count = 2000});
  const GaussianArrays<CudaBackend> arrays(cuda, scattered);
  const Meshes meshes(cuda);
  const std::vector<Camera> cameras = ring_of(many_cameras());
  const std::vector<MeshFrame> all(cameras.size(), MeshFrame{meshes.both});
  for (int i = 0; i < 4; ++i) {
    CAPTURE(i);
    RenderConfig config;
    config.composite = Composite::hard_depth;
    config.background = {0.2, 0.4, 0.9};
    if (i % 2 == 1) config.quality = Quality::fast();
    GaussianSet set = arrays.set();
    if (i >= 2) set.color_space = config.blend_space = ColorSpace::linear;
    CudaBatchRenderer renderer(cuda, config);
    CHECK(CudaBatchRenderer::supports(config, std::vector{set}, all[0]).ok());
    const std::vector<Camera> few(cameras.begin(), cameras.begin() + 2);
    for (const std::vector<Camera>& seen : {few, cameras}) {
      const std::vector<MeshFrame> of_seen(seen.size(), all[0]);
      const Frames<float> expected = singly(cuda, {set}, seen, {}, config, kAll, of_seen);
      int turn = (i + 1) / 2;
      for (const unsigned outputs : {kAll, kMedianOnly, unsigned{kMedianDepth}, unsigned{kRgb}}) {
        if (is_emulated() && ++turn % 2 != 0) continue;  // each output by two of four rules
        CAPTURE(outputs);
        const Batch got = draw_batch(cuda, renderer, {set}, seen, {}, outputs, true, of_seen);
        check_same(got.frames, singly(cuda, {set}, seen, {}, config, outputs, of_seen));
        std::size_t wrong = 0;
        for (std::size_t k = 0; k < got.rgb8.size(); ++k)
          wrong += got.rgb8[k] != to_byte(expected.rgb[k]);
        CHECK(wrong == 0);
      }
    }
    // Cameras without meshes have another rule.
    std::vector<MeshFrame> some = all;
    some[1] = {};
    std::vector<BatchCamera> mixed;
    for (std::size_t c = 0; c < cameras.size(); ++c) mixed.push_back({cameras[c], {}, some[c]});
    BatchImages to;
    Buffer<float, CudaBackend> depth(cuda);
    depth.resize_discard(cameras.size() *
                         static_cast<std::size_t>(cameras[0].width * cameras[0].height));
    to.floats.median_depth = depth.data();
    const Status refused = renderer.render(std::vector{set}, mixed, to);
    CHECK(refused.code() == Errc::unsupported);
    CHECK(refused.message().find("cameras[1]: with Composite::hard_depth") != std::string::npos);
    const Batch without = draw_batch(cuda, renderer, {set}, cameras, {}, kAll);
    check_same(without.frames, singly(cuda, {set}, cameras, {}, config, kAll));
  }
}

TEST_CASE("cuda batch: counts of triangles stay on the device, and what does not fit is drawn again") {
  if (no_gpu("cuda batches of many triangles")) return;
  CudaBackend cuda;
  const GaussianCloud scattered = random_cloud(7, {.count = 2000});
  const GaussianArrays<CudaBackend> arrays(cuda, scattered);
  SurfaceMesh ball = sphere(0.4, 16, 10);
  ball.two_sided = true;  // nearly all of it is drawn: more than is guessed
  ball.geometry.vertices[70].x = std::numeric_limits<float>::quiet_NaN();
  MeshScene scene;
  scene.add(ball).value();
  const MeshArrays<CudaBackend> there(cuda, scene.instance(0, {}, 0).mesh);
  std::vector<MeshInstance> balls;
  for (int i = 0; i < 12; ++i) {
    const Vec3d at{0.45 * (i % 4 - 1.5), 0.4 * (i / 4 - 1), 3.6 + 0.1 * (i % 5)};
    balls.push_back(there.instance({{1, 0, 0, 0}, at, 1.0}, static_cast<std::uint32_t>(i)));
  }
  // Few cameras; many; and more pixels than one wave has, which an emulated device would take minutes
  // for.
  std::vector<std::vector<Camera>> rings{ring(4, 97, 64), ring_of(is_emulated() ? 20 : 60)};
  if (!is_emulated()) rings.push_back(ring(76, 640, 352));
  for (const std::vector<Camera>& cameras : rings) {
    CAPTURE(cameras.size());
    std::vector<MeshFrame> seen;
    for (std::size_t c = 0; c < cameras.size(); ++c)
      seen.push_back({std::span(balls).first(c % 13), {}});
    MeshStats expected;
    MeshWorkspace<float, CudaBackend> alone(cuda);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      MeshStats one;
      draw_meshes<float>(cuda, alone, seen[c].instances, cameras[c], seen[c].light, 16, false, {}, &one)
          .throw_if_error();
      expected.triangles += one.triangles;
      expected.not_finite += one.not_finite;
      expected.drawn += one.drawn;
    }
    CHECK(expected.not_finite > 0);
    CudaBatchRenderer renderer(cuda);
    const Frames<float> frames = singly(cuda, {arrays.set()}, cameras, {}, {}, kMedianOnly, seen);
    for (int call = 0; call < 2; ++call) {
      const Batch got =
          draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianOnly, false, seen);
      check_same(got.frames, frames);
      CHECK(got.stats.meshes.triangles == expected.triangles);
      CHECK(got.stats.meshes.not_finite == expected.not_finite);
      CHECK(got.stats.meshes.drawn == expected.drawn);
      if (call == 1) CHECK(got.stats.reruns == 0);
      if (call == 0 && cameras.size() > 4) CHECK(got.stats.reruns > 0);
    }
  }
}

namespace {

/// Holds a stream until it is opened, or gives up.
struct Gate {
  std::atomic<bool> open{false}, gave_up{false};
  static void CUDART_CB wait(void* self) {
    Gate& g = *static_cast<Gate*>(self);
    const auto start = std::chrono::steady_clock::now();
    while (!g.open) {
      if (std::chrono::steady_clock::now() - start > std::chrono::seconds(20)) {
        g.gave_up = true;
        return;
      }
      std::this_thread::yield();
    }
  }
};

}  // namespace

TEST_CASE("cuda batch: a steady call returns while the device is busy, with meshes and without") {
  if (no_gpu("cuda batches that wait for nothing")) return;
  CudaBackend cuda;
  const GaussianCloud scattered = random_cloud(8, {.count = 3000});
  const GaussianArrays<CudaBackend> arrays(cuda, scattered);
  const std::vector<GaussianSet> sets{arrays.set()};
  const Meshes meshes(cuda);
  constexpr std::size_t kPixels = 97 * 64;
  for (const bool with_meshes : {false, true}) {
    CAPTURE(with_meshes);
    std::vector<BatchCamera> cameras;
    for (const Camera& c : ring(5, 97, 64)) {
      cameras.push_back({c, {}, with_meshes ? MeshFrame{meshes.both} : MeshFrame{}});
    }
    Buffer<float, CudaBackend> images(cuda);
    images.resize_discard(4 * kPixels * cameras.size());
    BatchImages to;
    to.floats.rgb = images.data();
    to.floats.median_depth = images.data() + 3 * kPixels * cameras.size();
    CudaBatchRenderer renderer(cuda);
    for (int i = 0; i < 6; ++i) {  // scratch is found, launches are recorded
      renderer.render(sets, cameras, to).throw_if_error();
      renderer.finish().throw_if_error();
    }
    for (const double step : {0.0, 0.01}) {  // the same again, and moved
      for (BatchCamera& c : cameras) c.camera.viewmat.translation.x += step;
      Gate gate;
      REQUIRE(cudaLaunchHostFunc(cuda.stream(), Gate::wait, &gate) == cudaSuccess);
      const Status s = renderer.render(sets, cameras, to);
      const bool waited = gate.gave_up;
      gate.open = true;
      CHECK(s.ok());
      CHECK(!waited);
      CHECK(renderer.finish().ok());
      CHECK(renderer.stats().reruns == 0);
    }
  }
}
#endif
