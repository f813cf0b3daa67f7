// SPDX-License-Identifier: Apache-2.0
// Calls of the batched renderer one after another: what is kept between them, and what several under way
// share.
#include <doctest/doctest.h>

#include <cstdio>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda/pinned.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// That see all sets.
std::vector<BatchCamera> batch_of(const std::vector<Camera>& cameras) {
  std::vector<BatchCamera> batch;
  for (const Camera& c : cameras) batch.push_back({c, {}});
  return batch;
}

/// RGB and median depth of all cameras, drawn into `images`: where that stays, launches may be replayed.
std::vector<float> draw_into(CudaBackend& cuda, CudaBatchRenderer& renderer, float* images,
                             const std::vector<GaussianSet>& sets, const std::vector<Camera>& cameras) {
  const std::size_t pixels = static_cast<std::size_t>(cameras[0].width) *
                             static_cast<std::size_t>(cameras[0].height) * cameras.size();
  BatchImages to;
  to.floats.rgb = images;
  to.floats.median_depth = images + 3 * pixels;
  cuda.fill(images, 0xa5, 4 * pixels * sizeof(float));
  renderer.render(sets, batch_of(cameras), to).throw_if_error();
  renderer.finish().throw_if_error();
  std::vector<float> out(4 * pixels);
  cuda.copy(out.data(), images, out.size() * sizeof(float), CopyKind::device_to_host);
  REQUIRE(cuda.synchronize().ok());
  return out;
}

}  // namespace

TEST_CASE("cuda batch: calls that differ in their cameras alone are replayed, with the same bits") {
  if (no_gpu("cuda batch replays")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(31, {.count = 2500, .needle = 0.2});
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<Camera> cameras = ring(12, 72, 50);
  const std::vector<GaussianSet> sets{arrays.set()};
  const std::size_t pixels = 72 * 50;
  const auto frames_of = [&](CudaBatchRenderer& renderer, float* images, const Camera& camera) {
    return draw_into(cuda, renderer, images, sets, {camera});
  };
  Buffer<float, CudaBackend> images(cuda), elsewhere(cuda);
  images.resize_discard(4 * pixels);
  elsewhere.resize_discard(4 * pixels);
  CudaBatchRenderer renderer(cuda);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const std::vector<float> got = frames_of(renderer, images.data(), cameras[i]);
    if (i >= 8) CHECK(renderer.stats().replayed);
    CudaBatchRenderer fresh(cuda);
    CHECK(differing(got, frames_of(fresh, images.data(), cameras[i])) == 0);
    CHECK_FALSE(fresh.stats().replayed);
  }
  // Other images: not the recorded launches.
  const std::vector<float> moved = frames_of(renderer, elsewhere.data(), cameras[3]);
  CHECK_FALSE(renderer.stats().replayed);
  CHECK(differing(moved, frames_of(renderer, images.data(), cameras[3])) == 0);
}

TEST_CASE("cuda batch: recorded calls know where scratch is, after others have moved it") {
  if (no_gpu("cuda batch scratch that moves")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(33, {.count = is_emulated() ? 1000 : 8000, .needle = 0.2});
  GaussianCloud out_of_view =
      random_cloud(34, {.count = is_emulated() ? 50000 : 300000, .sh_degree = 0});
  for (float& z : out_of_view.means[2]) z -= 50;
  const GaussianArrays<CudaBackend> arrays(cuda, cloud), behind(cuda, out_of_view);
  const std::vector<GaussianSet> alone{arrays.set()}, both{arrays.set(), behind.set()};
  const std::vector<Camera> crowd = ring(many_tiles() / 9, 40, 36), one{crowd[4]};
  Buffer<float, CudaBackend> images(cuda), elsewhere(cuda);
  images.resize_discard(4 * 40 * 36 * crowd.size());
  elsewhere.resize_discard(4 * 40 * 36);
  CudaBatchRenderer fresh(cuda), renderer(cuda);
  const std::vector<float> expected = draw_into(cuda, fresh, elsewhere.data(), alone, one);
  draw_into(cuda, renderer, images.data(), both,
            crowd);  // room for all arrays that few cameras and many share
  for (int i = 0; i < 8; ++i)
    CHECK(differing(draw_into(cuda, renderer, images.data(), alone, one), expected) == 0);
  CHECK(renderer.stats().replayed);
  // Moves what few cameras alone have.
  CHECK(differing(draw_into(cuda, renderer, images.data(), both, one), expected) == 0);
  for (int i = 0; i < 4; ++i)
    CHECK(differing(draw_into(cuda, renderer, images.data(), alone, one), expected) == 0);
}

TEST_CASE("cuda batch: images go to another stream and to pinned memory without the host waiting") {
  if (no_gpu("cuda batch hand-over")) return;
  CudaBackend cuda, learner;
  const GaussianCloud cloud = random_cloud(41, {.count = 20000});
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<GaussianSet> sets{arrays.set()};
  const std::vector<Camera> cameras = ring(8, 128, 96);
  const std::size_t values = 8 * 128 * 96;
  Buffer<float, CudaBackend> depth(cuda), taken(learner);
  depth.resize_discard(values);
  taken.resize_discard(values);
  PinnedArray<float> here(values), there(values);
  const std::vector<BatchCamera> batch = batch_of(cameras);
  // [snippet: batch]
  BatchImages to;
  to.floats.median_depth = depth.data();  // device memory, [cameras][height][width]
  CudaBatchRenderer renderer(cuda);
  renderer.render(sets, batch, to).throw_if_error();  // returns at once
  renderer.finish().throw_if_error();                 // now the images are whole
  // [/snippet]
  // Scratch has grown to the size of these calls.
  for (int run = 0; run < (is_emulated() ? 2 : 5); ++run) {
    cuda.fill(depth.data(), 0xa5, values * sizeof(float));
    renderer.render(sets, batch, to).throw_if_error();
    cuda.copy(here.data(), depth.data(), values * sizeof(float), CopyKind::device_to_host);
    cuda.hand_over_to(learner.stream());
    learner.copy(taken.data(), depth.data(), values * sizeof(float), CopyKind::device_to_device);
    learner.copy(there.data(), taken.data(), values * sizeof(float), CopyKind::device_to_host);
    learner.hand_over_to(cuda.stream());  // the next images wait until these are taken
    renderer.finish().throw_if_error();
    REQUIRE(learner.synchronize().ok());
    std::size_t wrong = 0, seen = 0;
    for (std::size_t i = 0; i < values; ++i) {
      wrong += here.data()[i] == there.data()[i] ? 0u : 1u;
      seen += here.data()[i] > 0.1f ? 1u : 0u;
    }
    CHECK(wrong == 0);
    CHECK(seen > values / 4);
  }
}

TEST_CASE("cuda batch: scratch that is too small grows, and says so") {
  if (no_gpu("cuda batch overflow")) return;
  CudaBackend cuda;
  const GaussianCloud small = random_cloud(11, {.count = 50});
  const GaussianCloud big = random_cloud(12, {.count = is_emulated() ? 20000 : 60000, .needle = 0.2});
  const GaussianArrays<CudaBackend> few(cuda, small), many(cuda, big);
  const std::vector<Camera> cameras = ring(9, 96, 80);
  CudaBatchRenderer renderer(cuda);
  CHECK(draw_batch(cuda, renderer, {few.set()}, cameras, {}, kMedianOnly).stats.reruns == 0);
  const Batch grown = draw_batch(cuda, renderer, {many.set()}, cameras, {}, kMedianOnly);
  CHECK(grown.stats.reruns > 0);
  check_same(grown.frames, singly(cuda, {many.set()}, cameras, {}, {}, kMedianOnly));
  const Batch steady = draw_batch(cuda, renderer, {many.set()}, cameras, {}, kMedianOnly);
  CHECK(steady.stats.reruns == 0);
  CHECK(steady.stats.scratch_bytes == grown.stats.scratch_bytes);
  check_same(steady.frames, grown.frames);
}

TEST_CASE(
    "cuda batch: of calls under way that scratch is too small for, the last is drawn again and others "
    "are told") {
  if (no_gpu("cuda batch calls under way")) return;
  CudaBackend cuda;
  const GaussianCloud small = random_cloud(11, {.count = 50});
  const GaussianCloud big = random_cloud(
      12, {.count = is_emulated() ? 2500 : 60000, .needle = 0.2, .scale = is_emulated() ? 0.4 : 0.1});
  const GaussianArrays<CudaBackend> few(cuda, small), many(cuda, big);
  const std::vector<GaussianSet> sets{many.set()};
  const std::vector<Camera> cameras = ring(9, 96, 80);
  const std::size_t pixels = 9 * 96 * 80;
  Buffer<float, CudaBackend> images(cuda);
  images.resize_discard(6 * pixels);
  const auto start = [&](CudaBatchRenderer& renderer, std::size_t place) {
    BatchImages to;
    to.floats.rgb = images.data() + 3 * pixels * place;
    cuda.fill(to.floats.rgb, 0xa5, 3 * pixels * sizeof(float));
    renderer.render(sets, batch_of(cameras), to).throw_if_error();
  };
  const auto image = [&](std::size_t place) {
    Frames<float> out;
    out.rgb.resize(3 * pixels);
    images.download(out.rgb.data(), out.rgb.size(), 3 * pixels * place);
    REQUIRE(cuda.synchronize().ok());
    return out;
  };
  const Frames<float> expected = singly(cuda, sets, cameras, {}, {}, kRgb);
  const auto small_one = [&](CudaBatchRenderer& renderer) {
    CHECK(draw_batch(cuda, renderer, {few.set()}, cameras, {}, kMedianOnly).stats.reruns == 0);
  };
  {
    CudaBatchRenderer renderer(cuda);
    small_one(renderer);
    start(renderer, 0);
    start(renderer, 1);
    const Status told = renderer.finish();
    CHECK(told.code() == Errc::out_of_memory);
    CHECK(told.message().find("draw it again") != std::string::npos);
    CHECK(renderer.stats().reruns > 0);
    check_same(image(1), expected);
    start(renderer, 0);
    start(renderer, 1);
    CHECK(renderer.finish().ok());
    CHECK(renderer.stats().reruns == 0);
    check_same(image(0), expected);
    check_same(image(1), expected);
  }
  {  // A call that cannot be: what the one before it was made of is no longer there.
    CudaBatchRenderer renderer(cuda);
    small_one(renderer);
    start(renderer, 0);
    const Camera huge = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 16384, 16384, 70);
    const std::vector<BatchCamera> too_many(2048, BatchCamera{huge, {}});
    CHECK(renderer.capacity(sets, too_many) == 2047);  // 2^20 tiles each
    const Status refused = renderer.render(sets, too_many, {});
    CHECK(refused.code() == Errc::unsupported);
    CHECK(refused.message().find("tiles") != std::string::npos);
    CHECK(renderer.finish().code() == Errc::out_of_memory);
    start(renderer, 0);
    CHECK(renderer.finish().ok());
    check_same(image(0), expected);
    CHECK(renderer.render(sets, too_many, {}).code() == Errc::unsupported);
    start(renderer, 1);
    CHECK(renderer.finish().ok());
    check_same(image(1), expected);
  }
}

TEST_CASE("cuda batch: how many cameras a call can draw is told beforehand") {
  if (no_gpu("cuda batch capacity")) return;
  CudaBackend cuda;
  const GaussianCloud scattered = random_cloud(5, {.count = 3000});
  const GaussianArrays<CudaBackend> arrays(cuda, scattered);
  const std::vector<GaussianSet> sets{arrays.set()};
  CudaBatchRenderer renderer(cuda);
  CHECK(renderer.capacity(sets, {}) == 0);
  CHECK(renderer.capacity(sets, batch_of(ring(12, 64, 48))) == 12);
  const std::vector<BatchCamera> many(70000, batch_of(ring(1, 64, 48)).front());
  CHECK(renderer.capacity(sets, many) == 65535);
  Buffer<float, CudaBackend> images(cuda);
  images.resize_discard(12 * 4 * 64 * 48);
  draw_into(cuda, renderer, images.data(), sets, ring(12, 64, 48));
  CHECK(renderer.capacity(sets, batch_of(ring(12, 64, 48))) == 12);
  // As much as each of the twelve took does not fit 65535 times into 6 GiB.
  if (is_emulated()) CHECK(renderer.capacity(sets, many) < 65535);
  // 2^31 parts of chunks, for each camera's own set.
  GaussianSet wide = sets.front();
  wide.gaussians.shape.size = std::size_t{1} << 31;
  const std::vector<GaussianSet> own(1000, wide);
  std::vector<std::uint32_t> numbers(own.size());
  std::vector<BatchCamera> each(own.size(), many.front());
  for (std::uint32_t i = 0; i < own.size(); ++i) {
    numbers[i] = i;
    each[i].sets = std::span(numbers).subspan(i, 1);
  }
  CHECK(CudaBatchRenderer(cuda).capacity(own, each) == 63);
}
#else
TEST_CASE("cuda batch calls") { std::printf("SKIP: cuda batch calls: built without CUDA\n"); }
#endif
