// SPDX-License-Identifier: Apache-2.0
// The GPU against the CPU: the same kernels must give the same bits.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#include "ops/no_gpu.hpp"
#include "ops/stage_frames.hpp"
#include "support/frame_images.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A frame by the stages. BasicRenderer, which draws it as a batch of one, must have the same bits.
Frames<float> on_gpu(CudaBackend& cuda, const std::vector<const GaussianCloud*>& clouds,
                     const Camera& camera, const RenderConfig& config) {
  std::vector<GaussianArrays<CudaBackend>> arrays;
  std::vector<GaussianSet> sets;
  arrays.reserve(clouds.size());
  for (const GaussianCloud* c : clouds) sets.push_back(arrays.emplace_back(cuda, *c).set());
  const Frames<float> frames = draw_by_stages<float>(cuda, sets, std::span(&camera, 1), config);
  BasicRenderer<float, CudaBackend> renderer(cuda, config);
  const Frames<float> batch = renderer.render(sets, std::span(&camera, 1)).value();
  for_each_image(frames, batch, [](const auto& a, const auto& b) { CHECK(a == b); });
  CHECK(batch.stats[0].gaussians == frames.stats[0].gaussians);
  // Batches count no visible Gaussians. Their tiles have another size.
  CHECK(batch.stats[0].visible == 0);
  CHECK((batch.stats[0].tile_intersections > 0) == (frames.stats[0].tile_intersections > 0));
  return frames;
}

double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::abs(double{a[i]} - double{b[i]}));
  return worst;
}

}  // namespace

TEST_CASE("cuda: images have the serial backend's bits") {
  if (no_gpu("cuda images")) return;
  CudaBackend cuda;
  SerialBackend serial;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const GaussianCloud a = random_cloud(seed, {.count = 4000, .needle = 0.3, .mip = seed == 2});
    const GaussianCloud b = random_cloud(seed + 10, {.count = 2500, .sh_degree = 1, .scale = 0.2});
    Camera camera = Camera::look_at({0.3, -0.2, 0.5}, {0.1, 0.1, 4}, {0, -1, 0.1},
                                    is_emulated() ? 131 : 197, is_emulated() ? 87 : 131, 100);
    camera.cx += 13.25;
    for (const int tile : {8, 16, 32}) {
      for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
        // Emulated: every two of seed, tile and response meet once.
        if (is_emulated() &&
            (seed + static_cast<unsigned>(tile) / 16 + static_cast<unsigned>(response)) % 3 != 0)
          continue;
        RenderConfig config;
        config.outputs = kRgb | kAlpha | kAnyDepth;
        config.tuning.tile_size = tile;
        config.response = response;
        const auto gpu = on_gpu(cuda, {&a, &b}, camera, config);
        const auto cpu = render<float>(serial, {a.set(), b.set()}, camera, config);
        CHECK(gpu.stats[0].visible == cpu.stats[0].visible);
        CHECK(gpu.stats[0].tile_intersections == cpu.stats[0].tile_intersections);
        CHECK(gpu.rgb == cpu.rgb);
        CHECK(gpu.alpha == cpu.alpha);
        CHECK(gpu.median_depth == cpu.median_depth);
        CHECK(gpu.expected_depth == cpu.expected_depth);
        CHECK(gpu.accumulated_depth == cpu.accumulated_depth);
        CHECK(gpu.first_hit_depth == cpu.first_hit_depth);
      }
    }
  }
}

TEST_CASE("cuda: outputs asked for alone, profiles and compat modes") {
  if (no_gpu("cuda outputs")) return;
  CudaBackend cuda;
  SerialBackend serial;
  const GaussianCloud cloud = random_cloud(7, {.count = 3000});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 97, 64, 70);
  for (const unsigned outputs : {unsigned{kRgb}, unsigned{kAlpha}, unsigned{kMedianDepth},
                                 kRgb | kMedianDepth, unsigned{kExpectedDepth}}) {
    for (const Exponential profile : {Exponential::exact, Exponential::fast}) {
      RenderConfig config;
      config.outputs = outputs;
      config.quality.exponential = profile;
      const auto gpu = on_gpu(cuda, {&cloud}, camera, config);
      const auto cpu = render<float>(serial, {cloud.set()}, camera, config);
      if (profile == Exponential::exact) {
        CHECK(gpu.rgb == cpu.rgb);
        CHECK(gpu.alpha == cpu.alpha);
        CHECK(gpu.median_depth == cpu.median_depth);
        CHECK(gpu.expected_depth == cpu.expected_depth);
      } else {
        // On the GPU `fast` has the exponential of the hardware, on the CPU a cubic, off by 1e-4 of
        // alpha.
        CHECK(largest_difference(gpu.rgb, cpu.rgb) < 3e-4);
        CHECK(largest_difference(gpu.alpha, cpu.alpha) < 3e-4);
        config.quality.exponential = Exponential::exact;
        const auto exact = on_gpu(cuda, {&cloud}, camera, config);
        CHECK(largest_difference(gpu.rgb, exact.rgb) < 2e-6);
        CHECK(largest_difference(gpu.alpha, exact.alpha) < 2e-6);
      }
    }
  }
  for (const Compat compat : {Compat::inria, Compat::gsplat, Compat::habitat_gs}) {
    RenderConfig config;
    config.compat = compat;
    CHECK(on_gpu(cuda, {&cloud}, camera, config).rgb ==
          render<float>(serial, {cloud.set()}, camera, config).rgb);
  }
}

TEST_CASE("N64_cpu_cuda_keys") {
  if (no_gpu("N64_cpu_cuda_keys")) return;
  CloudOptions options;
  options.count = is_emulated() ? 100000 : 2000000;
  options.sh_degree = 1;
  options.scale = 0.01;
  options.center = {0, 0, 2};
  options.extent = 3;
  const GaussianCloud cloud = random_cloud(64, options);
  const Camera camera = Camera::look_at({0.1, -0.2, 0.3}, {0.1, 0.1, 4}, {0, -1, 0.1},
                                        is_emulated() ? 320 : 640, is_emulated() ? 240 : 480, 90);
  const auto run = [&](auto& backend, Frames<float>& frames, auto& keys, auto& offsets, auto& splats) {
    using B = std::remove_reference_t<decltype(backend)>;
    const GaussianArrays<B> arrays(backend, cloud);
    const std::vector<GaussianSet> sets{arrays.set()};
    RenderWorkspace<float, B> workspace(backend);
    const std::size_t pixels = static_cast<std::size_t>(camera.width * camera.height);
    Buffer<float, B> images(backend);
    images.resize_discard(5 * pixels);
    const FrameImages<float> out{
        images.data(), images.data() + 3 * pixels, images.data() + 4 * pixels, nullptr, nullptr,
        nullptr};
    REQUIRE(render_camera<float>(backend, workspace, sets, camera, RenderConfig{}, out).ok());
    // Once more on memory that is written: keys of what was culled are fetched with the others.
    auto& chunk_keys = workspace.visible.chunk_keys;
    backend.fill(chunk_keys.data(), 0, chunk_keys.size() * sizeof(std::uint32_t));
    REQUIRE(render_camera<float>(backend, workspace, sets, camera, RenderConfig{}, out).ok());
    const auto fetch = [](const auto& buffer, auto& host) {
      host.resize(buffer.size());
      buffer.download(host.data(), host.size());
    };
    fetch(images, frames.rgb);
    std::vector<std::uint32_t> by_slot, order;
    fetch(chunk_keys, by_slot);
    fetch(workspace.visible.order, order);
    fetch(workspace.tile_offsets, offsets);
    fetch(workspace.tile_splats, splats);
    REQUIRE(backend.synchronize().ok());
    for (const std::uint32_t slot : order) keys.push_back(by_slot[slot]);
  };
  CudaBackend cuda;
  SerialBackend serial;
  Frames<float> a, b;
  std::vector<std::uint32_t> keys_a, keys_b, splats_a, splats_b;
  std::vector<std::uint64_t> offsets_a, offsets_b;
  run(cuda, a, keys_a, offsets_a, splats_a);
  run(serial, b, keys_b, offsets_b, splats_b);
  CHECK(keys_a.size() > static_cast<std::size_t>(options.count) / 20);
  CHECK(keys_a == keys_b);
  CHECK(offsets_a == offsets_b);
  CHECK(splats_a == splats_b);
  CHECK(a.rgb == b.rgb);
}

TEST_CASE("cuda: an empty view, a steady frame, errors that say what to do") {
  if (no_gpu("cuda states")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(8, {.count = 500});
  const Camera away = Camera::look_at({0, 0, 0}, {0, 0, -4}, {0, -1, 0}, 40, 30, 70);
  RenderConfig config;
  config.background = {0.25, 0.5, 0.75};
  const auto f = on_gpu(cuda, {&cloud}, away, config);
  CHECK(f.rgb[1] == 0.5f);
  CHECK(f.alpha[0] == 0.0f);
  CHECK(cuda.synchronize().ok());
  try {
    CudaBackend beyond(CudaBackend::device_count());
    FAIL("a device that is not there was taken");
  } catch (const Error& e) {
    CHECK(std::string(e.what()).find("device = ") != std::string::npos);
  }
}
#else
TEST_CASE("cuda") { std::printf("SKIP: cuda: built without CUDA\n"); }
#endif
