// SPDX-License-Identifier: Apache-2.0
// SH bands that a scene does not need, on backends with a memory of their own: not read, and where no
// chunk has them not held; the images are those of all bands.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "gsnav/detail/scene/drop_bands.hpp"
#include "gsnav/detail/scene/scene_bands.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "gsnav/scene/packed_cloud.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"
#endif

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// A cloud of degree 3 of which chunk c has the bands up to c % (most + 1), the others zero; its
/// profile; and the same cloud with NaN in all that is not to be read.
struct Banded {
  explicit Banded(int most, bool halves = false) {
    cloud = random_cloud(12, {.count = 2500});
    sort_spatially(cloud);
    marked = cloud;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const int degree = static_cast<int>(i / kProjectChunk) % (most + 1);
      const std::size_t kept = 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1);
      for (std::size_t k = 45 * i + kept; k < 45 * (i + 1); ++k) {
        cloud.shN[k] = 0;
        marked.shN[k] = std::numeric_limits<float>::quiet_NaN();
      }
    }
    if (halves) {
      compact_sh(cloud);
      const std::vector<float> nan = marked.shN;
      compact_sh(marked);
      for (std::size_t k = 0; k < nan.size(); ++k) {
        if (std::isnan(nan[k])) marked.shN_half[k] = 0x7e00;
      }
    }
    profile = scene_bands(cloud);
  }
  GaussianCloud cloud, marked;
  SceneBands profile;
};

/// What a set of degree `degree` holds of N Gaussians.
void check_held(const GaussianRows& v, int degree) {
  CHECK(v.color.degree == degree);
  const std::size_t numbers = 3 * static_cast<std::size_t>(sh_coefficient_count(degree) - 1) * v.size();
  CHECK(v.color.shN.size + v.color.shN_half.size == numbers);
  CHECK(v.color.chunk_degrees.size == v.chunk_count());
}

}  // namespace

TEST_CASE(
    "SH bands: a memory of its own holds those that some chunk has, and none beyond a chunk's is read") {
  ToyBackend toy;
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 96, 64, 70);
  for (const int most : {3, 2, 1, 0}) {
    for (const bool halves : {false, true}) {
      CAPTURE(most);
      CAPTURE(halves);
      const Banded b(most, halves);
      const GaussianArrays<ToyBackend> all(toy, b.cloud), some(toy, b.marked, b.profile);
      check_held(some.set().gaussians, most);
      const Frames<float> expected = render<float>(toy, {all.set()}, camera),
                          got = render<float>(toy, {some.set()}, camera);
      CHECK(got.rgb == expected.rgb);
      CHECK(got.median_depth == expected.median_depth);
    }
  }
}

TEST_CASE("SH bands: of packed rows, too, another memory holds those that some chunk has") {
  ToyBackend toy;
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 96, 64, 70);
  for (const int most : {3, 1, 0}) {
    CAPTURE(most);
    PackedCloud packed = pack_cloud(Banded(most).cloud, {.sh = 1});
    REQUIRE(packed.shN.size() == 45 * packed.size());
    SceneBands profile = scene_bands(packed);
    const GaussianArrays<ToyBackend> all(toy, packed), some(toy, packed, profile);
    check_held(some.set().gaussians, most);
    const Frames<float> expected = render<float>(toy, {all.set()}, camera);
    CHECK(render<float>(toy, {some.set()}, camera).rgb == expected.rgb);
    drop_bands(packed, profile);
    const GaussianArrays<ToyBackend> dropped(toy, packed, profile);
    check_held(dropped.set().gaussians, most);
    CHECK(render<float>(toy, {dropped.set()}, camera).rgb == expected.rgb);
  }
}

#if defined(GSNAV_HAS_CUDA)
TEST_CASE("cuda: SH bands that chunks do not need are not read, in batches and alone") {
  if (no_gpu("cuda SH bands by chunk")) return;
  CudaBackend cuda;
  for (const int most : {3, 2, 1, 0}) {
    for (const bool halves : {false, true}) {
      if (is_emulated() && halves == (most % 2 == 0)) continue;
      const Banded b(most, halves);
      const GaussianArrays<CudaBackend> all(cuda, b.cloud), some(cuda, b.marked, b.profile);
      check_held(some.set().gaussians, most);
      for (const int limit : {kMaxShDegree, 1}) {
        for (const int count : {5, many_cameras()}) {
          // Emulated: every two of number of bands, limit and number of cameras.
          if (is_emulated() && (limit == 1) != ((count == 5) == (most % 3 == 0))) continue;
          CAPTURE(most);
          CAPTURE(halves);
          CAPTURE(limit);
          CAPTURE(count);
          RenderConfig config;
          config.quality.max_sh_degree = limit;
          CudaBatchRenderer renderer(cuda, config);
          const std::vector<Camera> cameras = ring_of(count);
          const Batch got = draw_batch(cuda, renderer, {some.set()}, cameras, {}, kMedianOnly);
          check_same(got.frames,
                     draw_batch(cuda, renderer, {all.set()}, cameras, {}, kMedianOnly).frames);
          if (count != 5) continue;
          check_same(got.frames, singly(cuda, {some.set()}, cameras, {}, config, kMedianOnly));
          // The contract's bound between the GPU and the CPU, which reads by the same rule.
          SerialBackend serial;
          BasicRenderer<float, SerialBackend> on_cpu(serial, config);
          const Frames<float> cpu =
              on_cpu.render(std::vector<GaussianSet>{b.profile.applied_to(b.marked.set())}, cameras)
                  .value();
          std::size_t over = 0, far_over = 0;
          for (std::size_t i = 0; i < cpu.rgb.size(); ++i) {
            const float d = std::abs(cpu.rgb[i] - got.frames.rgb[i]);
            over += d <= 2e-5f ? 0u : 1u;
            far_over += d <= 2e-4f ? 0u : 1u;
          }
          CHECK(over * 1000 <= cpu.rgb.size());
          CHECK(far_over == 0);
        }
      }
    }
  }
}
#endif
