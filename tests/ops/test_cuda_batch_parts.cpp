// SPDX-License-Identifier: Apache-2.0
// Parts of chunks that are out of view: the batched renderer reads none of them, and no image shows it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/detail/frame/cull.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"
#include "support/seen_rows.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Cameras in the middle of a cloud, most of which is behind them or beside.
std::vector<Camera> cameras_within(int count) {
  std::vector<Camera> cameras;
  Rng rng(77);
  const auto in = [&](double r) {
    return Vec3d{rng.uniform(-r, r), rng.uniform(-r, r), rng.uniform(-r, r)};
  };
  for (int c = 0; c < count; ++c) {
    const Vec3d eye = in(3);
    Camera camera = Camera::look_at(eye, eye + in(1) + Vec3d{0, 0, 0.1}, {0.1, 1, 0.05}, 72, 56,
                                    rng.uniform(30, 100));
    camera.near_plane = c % 2 == 0 ? 0.05 : 0.5;
    cameras.push_back(camera);
  }
  return cameras;
}

GaussianCloud without_bounds(GaussianCloud cloud) {
  cloud.chunk_bounds.clear();
  cloud.part_bounds.clear();
  return cloud;
}

/// Parts that batches may read of a set that all cameras see, by words of 32 cameras: those that have to
/// be, and those that may.
struct Parts {
  std::uint64_t least = 0, most = 0, of_chunks = 0;
};

Parts parts_of(const GaussianCloud& cloud, const std::vector<Camera>& cameras,
               const RenderConfig& config) {
  Parts n;
  for (std::size_t first = 0; first < cameras.size(); first += 32) {
    const std::size_t end = std::min(first + 32, cameras.size());
    for (std::size_t p = 0; p < cloud.part_bounds.size(); ++p) {
      const ChunkBounds& chunk = cloud.chunk_bounds[p * kChunkPart / kProjectChunk];
      bool least = false, most = false, whole = false;
      for (std::size_t c = first; c < end; ++c) {
        const auto c64 =
            make_projection_camera<double>(cameras[c], cloud.set(), projection_rules(config));
        if (!may_be_visible(c64, chunk)) continue;
        const bool part = may_be_visible(c64, cloud.part_bounds[p]);
        whole = true;
        least = least || part;
        most = most || part || lies_in_view(c64, chunk);
      }
      n.least += least ? 1 : 0;
      n.most += most ? 1 : 0;
      n.of_chunks += whole ? 1 : 0;
    }
  }
  return n;
}

}  // namespace

TEST_CASE("cuda batch: parts of chunks out of view are not read") {
  if (no_gpu("cuda batch parts")) return;
  CudaBackend cuda;
  GaussianCloud cloud = random_cloud(
      61,
      {.count = 20100, .sh_degree = 1, .needle = 0.01, .scale = 0.02, .center = {0, 0, 0}, .extent = 6});
  sort_spatially(cloud);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  // One instance of a set, several in a warp (three and eight have lanes left over and none), words
  // of 32.
  for (const int count : {1, 2, 3, 8, 9, 32, 45}) {
    CAPTURE(count);
    const std::vector<Camera> cameras = cameras_within(count);
    CudaBatchRenderer renderer(cuda);
    const Batch got = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianOnly);
    const Parts want = parts_of(cloud, cameras, {});
    CHECK(got.stats.parts_read >= want.least);
    CHECK(got.stats.parts_read <= want.most);
    if (count <= 3) CHECK(10 * got.stats.parts_read < 9 * want.of_chunks);  // or nothing was left out
  }
}

TEST_CASE("cuda batch: bounds of parts do not show") {
  if (no_gpu("cuda batch bounds of parts")) return;
  CudaBackend cuda;
  GaussianCloud a = random_cloud(
      62,
      {.count = 15050, .sh_degree = 3, .needle = 0.02, .scale = 0.03, .center = {0, 0, 0}, .extent = 5});
  GaussianCloud b =
      random_cloud(63, {.count = 6001, .sh_degree = 1, .scale = 0.05, .center = {1, 0, 0}, .extent = 4});
  sort_spatially(a);
  sort_spatially(b);
  const GaussianCloud c =
      random_cloud(64, {.count = 700, .sh_degree = 0, .center = {0, 0, 0}, .extent = 4});
  GaussianCloud only_chunks = b;
  only_chunks.part_bounds.clear();
  const GaussianCloud plain_a = without_bounds(a), plain_b = without_bounds(b);
  const GaussianArrays<CudaBackend> on_a(cuda, a), on_b(cuda, b), on_c(cuda, c), bare_a(cuda, plain_a),
      bare_b(cuda, plain_b), chunks_b(cuda, only_chunks);
  // Every other chunk, the last in part one of them.
  std::vector<std::uint32_t> drawn;
  for (std::uint32_t i = 0; i < b.view().chunk_count(); ++i) {
    if (i % 2 == (b.view().chunk_count() - 1) % 2) drawn.push_back(i);
  }
  Buffer<std::uint32_t, CudaBackend> list(cuda);
  list.upload(drawn.data(), drawn.size());
  Similarity placed;
  placed.translation = {0.4, -0.2, 0.3};
  placed.scale = 0.7;
  const auto sets_of = [&](const auto& of_a, const auto& of_b) {
    GaussianSet cut = of_b.set(placed);
    cut.selection.drawn_chunks = {list.data(), drawn.size()};
    return std::vector<GaussianSet>{of_a.set(), cut, on_c.set()};
  };
  std::uint64_t parts_read = 0, of_chunks = 0;
  for (const Response response : {Response::ewa, Response::ray}) {
    for (const int count : {1, 3, 8, 40}) {
      if (is_emulated() && response == Response::ray && count != 3) continue;
      CAPTURE(count);
      RenderConfig config;
      config.response = response;
      const std::vector<Camera> cameras = cameras_within(count);
      // Sets that some cameras see only.
      Lists lists;
      for (int i = 0; i < count; ++i) {
        lists.push_back(i % 3 == 1 ? std::vector<std::uint32_t>{2, 1}
                                   : std::vector<std::uint32_t>{0, 1, 2});
      }
      CudaBatchRenderer renderer(cuda, config);
      const Batch want = draw_batch(cuda, renderer, sets_of(bare_a, bare_b), cameras, lists, kAll);
      const Batch got = draw_batch(cuda, renderer, sets_of(on_a, on_b), cameras, lists, kAll);
      const Batch half = draw_batch(cuda, renderer, sets_of(on_a, chunks_b), cameras, lists, kAll);
      check_same(got.frames, want.frames);
      check_same(half.frames, want.frames);
      CHECK(got.stats.tile_intersections == want.stats.tile_intersections);
      check_same(got.frames, singly(cuda, sets_of(on_a, on_b), cameras, lists, config, kAll));
      CHECK(got.stats.parts_read <= half.stats.parts_read);
      CHECK(half.stats.parts_read <= want.stats.parts_read);
      parts_read += got.stats.parts_read;
      of_chunks += half.stats.parts_read;
    }
  }
  CHECK(parts_read < of_chunks);
}

TEST_CASE(
    "cuda batch: each camera draws what may be seen from where it is, as if the rest were transparent") {
  if (no_gpu("cuda batch of visible sets")) return;
  CudaBackend cuda;
  GaussianCloud a = random_cloud(
      65,
      {.count = 15050, .sh_degree = 1, .needle = 0.02, .scale = 0.03, .center = {0, 0, 0}, .extent = 5});
  GaussianCloud b =
      random_cloud(66, {.count = 3001, .sh_degree = 0, .scale = 0.05, .center = {1, 0, 0}, .extent = 4});
  sort_spatially(a);
  sort_spatially(b);
  const GaussianArrays<CudaBackend> on_a(cuda, a), on_b(cuda, b);
  const std::size_t words = (a.view().chunk_count() + 31) / 32;
  Rng rng(6);
  for (const int count : {1, 5, 40}) {
    CAPTURE(count);
    const std::vector<Camera> cameras = cameras_within(count);
    // Every third camera knows of chunks alone, every fourth of nothing.
    std::vector<std::uint32_t> bits;
    std::vector<std::size_t> begins{0};
    std::vector<GaussianCloud> rests;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      std::vector<bool> may = random_rows(rng, a.size());
      if (c % 3 == 1) {
        for (std::size_t i = 0; i < may.size(); ++i) may[i] = may[i / kProjectChunk * kProjectChunk];
      }
      std::vector<std::uint32_t> of_camera = seen_words(may);
      if (c % 3 == 1) of_camera.resize(words);
      if (c % 4 == 3) {
        of_camera.clear();
        may.assign(may.size(), true);
      }
      rests.push_back(only_seen(a, may));
      bits.insert(bits.end(), of_camera.begin(), of_camera.end());
      begins.push_back(bits.size());
    }
    Buffer<std::uint32_t, CudaBackend> there(cuda);
    there.upload(bits.data(), bits.size());
    std::vector<std::vector<View<const std::uint32_t>>> seen;
    Frames<float> want;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      seen.push_back({{there.data() + begins[c], begins[c + 1] - begins[c]}, {}});
      const GaussianArrays<CudaBackend> on_rest(cuda, rests[c]);
      const Frames<float> one = singly(cuda, {on_rest.set(), on_b.set()}, {cameras[c]}, {}, {}, kAll);
      for_each_image(want, one, [](std::vector<float>& to, const std::vector<float>& from) {
        to.insert(to.end(), from.begin(), from.end());
      });
    }
    CudaBatchRenderer renderer(cuda);
    const Batch got =
        draw_batch(cuda, renderer, {on_a.set(), on_b.set()}, cameras, {}, kAll, false, {}, seen);
    check_same(got.frames, want);
    // The generic path, of the first camera.
    GaussianSet alone = on_a.set();
    alone.selection.seen = seen[0][0];
    check_same(singly(cuda, {alone, on_b.set()}, {cameras[0]}, {}, {}, kAll),
               draw_batch(cuda, renderer, {alone, on_b.set()}, {cameras[0]}, {}, kAll, false).frames);
    const BatchCamera short_list{cameras[0], {}, {}, std::span(seen[0]).first(1)};
    const GaussianSet sets[] = {on_a.set(), on_b.set()};
    CHECK(renderer.render(sets, std::span(&short_list, 1), {}).code() == Errc::invalid_argument);
    const std::vector<View<const std::uint32_t>> wrong{{there.data(), words - 1}, {}};
    const BatchCamera of_wrong_size{cameras[0], {}, {}, wrong};
    CHECK(renderer.render(sets, std::span(&of_wrong_size, 1), {}).message().find("seen[0]") !=
          std::string::npos);
  }
}
#else
TEST_CASE("cuda batch parts") { std::printf("SKIP: cuda batch parts: built without CUDA\n"); }
#endif
