// SPDX-License-Identifier: Apache-2.0
// The batched renderer against one camera at a time: the same bits, whatever the batch.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdio>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/detail/scene/spatial_order.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("cuda batch: every camera has the bits it has alone") {
  if (no_gpu("cuda batch images")) return;
  CudaBackend cuda;
  GaussianCloud a = random_cloud(1, {.count = is_emulated() ? 1500 : 9000, .needle = 0.3});
  const GaussianCloud b =
      random_cloud(2, {.count = is_emulated() ? 900 : 2500, .sh_degree = 1, .scale = 0.2, .mip = true});
  const GaussianCloud c = random_cloud(3, {.count = 700, .sh_degree = 0, .scale = 0.02});
  sort_spatially(a);
  const GaussianArrays<CudaBackend> on_a(cuda, a), on_b(cuda, b), on_c(cuda, c);
  Similarity placed;
  placed.translation = {0.4, -0.2, 0.3};
  placed.scale = 0.7;
  const std::vector<GaussianSet> sets{on_a.set(), on_b.set(), on_c.set(placed)};
  const std::vector<Camera> cameras = ring_of(37);  // two words of instances
  Lists lists;
  for (std::uint32_t i = 0; i < 37; ++i) {
    lists.push_back(i % 4 == 0   ? std::vector<std::uint32_t>{2, 0}
                    : i % 4 == 1 ? std::vector<std::uint32_t>{1}
                    : i % 4 == 2 ? std::vector<std::uint32_t>{}
                                 : std::vector<std::uint32_t>{0, 1, 2});
  }
  for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
    for (const SortOrder order : {SortOrder::z_depth, SortOrder::camera_distance}) {
      RenderConfig config;
      config.response = response;
      config.sort_order = order;
      config.background = {0.25, 0.5, 0.75};
      CudaBatchRenderer renderer(cuda, config);
      for (const unsigned outputs : {kMedianOnly, kAll}) {
        // Emulated: two of the twelve, in which each rule occurs but the tangent plane.
        if (is_emulated() && ((order == SortOrder::z_depth) != (outputs == kAll) ||
                              response != (outputs == kAll ? Response::ewa : Response::ray)))
          continue;
        CAPTURE(static_cast<int>(response));
        CAPTURE(outputs);
        const Batch got = draw_batch(cuda, renderer, sets, cameras, lists, outputs);
        const Frames<float> expected = singly(cuda, sets, cameras, lists, config, outputs);
        check_same(got.frames, expected);
        std::size_t wrong_bytes = 0;
        for (std::size_t i = 0; i < got.rgb8.size(); ++i) {
          const float byte = std::floor(255.0f * std::clamp(expected.rgb[i], 0.0f, 1.0f) + 0.5f);
          wrong_bytes += static_cast<float>(got.rgb8[i]) == byte ? 0u : 1u;
        }
        CHECK(wrong_bytes == 0);
        CHECK(got.stats.tile_intersections > (is_emulated() ? 2000u : 10000u));
      }
    }
  }
}

TEST_CASE("cuda batch: the serial backend's bits; profiles and compat modes") {
  if (no_gpu("cuda batch profiles")) return;
  CudaBackend cuda;
  SerialBackend serial;
  const GaussianCloud cloud = random_cloud(7, {.count = is_emulated() ? 1500 : 3000});
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 97, 64, 70);
  for (const Compat compat : {Compat::none, Compat::inria, Compat::gsplat, Compat::habitat_gs}) {
    for (const Quality& quality : {Quality::exact(), Quality::fast()}) {
      RenderConfig config;
      config.compat = compat;
      config.quality = quality;
      CudaBatchRenderer renderer(cuda, config);
      for (const unsigned outputs :
           {unsigned{kRgb}, unsigned{kAlpha}, unsigned{kMedianDepth}, kMedianOnly, kAll}) {
        config.outputs = outputs;
        const Batch got = draw_batch(cuda, renderer, {arrays.set()}, {camera}, {}, outputs, false);
        check_same(got.frames, singly(cuda, {arrays.set()}, {camera}, {}, config, outputs));
        // On the GPU `fast` has the exponential of the hardware.
        if (quality == Quality::fast()) continue;
        check_same(got.frames, render<float>(serial, {cloud.set()}, camera, config));
      }
    }
  }
}

TEST_CASE("cuda batch: what only some sets or cameras have is in images of colours alone") {
  if (no_gpu("cuda batch rules")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(41, {.count = 1500}),
                      filtered = random_cloud(42, {.count = 1500, .mip = true});
  GaussianCloud far = random_cloud(43, {.count = 1500});
  far.origins = {{0, 0, 0}, {0.5, 0, 0}};
  for (std::size_t i = 0; i < far.size(); ++i) far.origin_ids.push_back(i % 2 == 0 ? 1 : 0);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud), on_mip(cuda, filtered), on_far(cuda, far);
  // Each Gaussian's bands turned by as much as its shape.
  GaussianSet turned = arrays.set();
  turned.gaussians.color.rotations = arrays.set().gaussians.shape.quats;
  enum class Has { nothing, mip, origins, rotations, near_sigma, distance };
  for (const Has has :
       {Has::nothing, Has::mip, Has::origins, Has::rotations, Has::near_sigma, Has::distance}) {
    CAPTURE(static_cast<int>(has));
    const std::vector<GaussianSet> sets{has == Has::mip         ? on_mip.set()
                                        : has == Has::origins   ? on_far.set()
                                        : has == Has::rotations ? turned
                                                                : arrays.set()};
    RenderConfig config;
    if (has == Has::distance) config.sort_order = SortOrder::camera_distance;
    for (const int count : {3, many_cameras()}) {
      std::vector<Camera> cameras = ring_of(count);
      for (Camera& camera : cameras) camera.near_sigma = 0;
      if (has == Has::near_sigma) cameras[1].near_sigma = 3;
      CudaBatchRenderer renderer(cuda, config);
      check_same(draw_batch(cuda, renderer, sets, cameras, {}, kMedianOnly, false).frames,
                 singly(cuda, sets, cameras, {}, config, kMedianOnly));
    }
  }
}

TEST_CASE("cuda batch: images of many pixels, and bands in half precision") {
  if (no_gpu("cuda batch of large images")) return;
  CudaBackend cuda;
  SerialBackend serial;
  for (const int degree : {1, 2, 3}) {
    // Splats of all sizes, some of which cover most tiles; rows that no warp has 32 of.
    GaussianCloud cloud =
        random_cloud(11, {.count = 4003, .sh_degree = degree, .needle = 0.2, .scale = 0.15});
    const GaussianCloud full = cloud;
    compact_sh(cloud);
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    const std::vector<GaussianSet> sets{arrays.set()};
    const std::vector<Camera> one = is_emulated() ? ring(1, 241, 180) : ring(1, 641, 480),
                              many = is_emulated() ? ring(9, 101, 69) : ring(9, 149, 101);
    RenderConfig config;
    config.outputs = kMedianOnly;
    CudaBatchRenderer renderer(cuda, config);
    const Batch large = draw_batch(cuda, renderer, sets, one, {}, kMedianOnly, false);
    check_same(large.frames, render<float>(serial, {cloud.set()}, one[0], config));
    check_same(draw_batch(cuda, renderer, sets, many, {}, kMedianOnly, false).frames,
               singly(cuda, sets, many, {}, config, kMedianOnly));
    const Frames<float> of_floats = render<float>(serial, {full.set()}, one[0], config);
    CHECK(differing(large.frames.rgb, of_floats.rgb) > 0);
    CHECK(differing(large.frames.median_depth, of_floats.median_depth) == 0);
  }
}

TEST_CASE("cuda batch: a list of the chunks to draw is a cloud of those chunks") {
  if (no_gpu("cuda batch chunks")) return;
  CudaBackend cuda;
  GaussianCloud cloud = random_cloud(31, {.count = 20000});
  sort_spatially(cloud);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  std::vector<std::uint32_t> drawn;
  for (std::uint32_t c = 0; c < cloud.view().chunk_count(); ++c) {
    if (c % 3 != 1 && c != 5) drawn.push_back(c);
  }
  Buffer<std::uint32_t, CudaBackend> list(cuda);
  list.resize_discard(drawn.size());
  list.upload(drawn.data(), drawn.size());
  GaussianSet set = arrays.set();
  set.selection.drawn_chunks = {list.data(), drawn.size()};
  // By hand: what is not drawn is too faint to be.
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto c = static_cast<std::uint32_t>(i / kProjectChunk);
    if (!std::binary_search(drawn.begin(), drawn.end(), c)) cloud.opacities[i] = 1e-4f;
  }
  const GaussianArrays<CudaBackend> faint(cuda, cloud);
  const GaussianCloud beside = random_cloud(32, {.count = 900});
  const GaussianArrays<CudaBackend> other(cuda, beside);
  const std::vector<GaussianSet> sets{set, other.set()}, by_hand{faint.set(), other.set()};
  for (const int count : {3, many_cameras()}) {
    const std::vector<Camera> cameras = ring_of(count);
    CudaBatchRenderer renderer(cuda);
    const Batch got = draw_batch(cuda, renderer, sets, cameras, {}, kAll),
                want = draw_batch(cuda, renderer, by_hand, cameras, {}, kAll);
    check_same(got.frames, want.frames);
    check_same(got.frames, singly(cuda, sets, cameras, {}, {}, kAll));
  }
}

TEST_CASE("cuda batch: long lists, and thousands of Gaussians at one depth, are in order of rank") {
  if (no_gpu("cuda batch order")) return;
  CudaBackend cuda;
  SerialBackend serial;
  // A wall across the view: every key is equal, and tiles hold more than fits into shared memory. Faint,
  // so that pixels stay open to the end.
  GaussianCloud cloud = faint_cloud(
      30000, [](double) { return 0.02; },
      [](int i, Rng& rng) {
        return Vec3d{rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4),
                     i < 20000 ? 2.0 : rng.uniform(1, 3)};
      });
  Camera camera;
  camera.set_hfov(48, 48, 60);
  camera.cx = camera.cy = 24;
  for (const bool sorted : {false, true}) {
    if (sorted) sort_spatially(cloud);
    if (is_emulated() && !sorted) continue;
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    CudaBatchRenderer renderer(cuda);
    const Batch got = draw_batch(cuda, renderer, {arrays.set()}, {camera, camera}, {}, kAll, false);
    Frames<float> expected = singly(cuda, {arrays.set()}, {camera, camera}, {}, {}, kAll);
    check_same(got.frames, expected);
    // Many cameras have lists of other tiles, put in order in another way.
    const std::vector<Camera> many(static_cast<std::size_t>(many_tiles() / 9), camera);
    const Batch crowd = draw_batch(cuda, renderer, {arrays.set()}, many, {}, kMedianOnly, false);
    for (const std::size_t c : {std::size_t{0}, many.size() - 1}) {
      const auto rgb = crowd.frames.rgb.begin() + static_cast<std::ptrdiff_t>(c * 3 * 48 * 48);
      const auto one = got.frames.rgb.begin();
      CHECK(differing(std::vector<float>(rgb, rgb + 3 * 48 * 48),
                      std::vector<float>(one, one + 3 * 48 * 48)) == 0);
    }
    RenderConfig config;
    config.outputs = kRgb;
    const auto cpu = render<float>(serial, {cloud.set()}, camera, config);
    expected.rgb.resize(cpu.rgb.size());
    CHECK(differing(cpu.rgb, expected.rgb) == 0);
  }
}

TEST_CASE(
    "cuda batch: a large image has lists of all lengths, with few and many Gaussians at one depth") {
  if (no_gpu("cuda batch order of large images")) return;
  CudaBackend cuda;
  SerialBackend serial;
  GaussianCloudBuilder builder(0);
  Rng rng(7);
  const auto add = [&](double x, double y, double z, double scale) {
    RawGaussian g;
    g.mean = {x, y, z};
    g.quat = {1, 0, 0, 0};
    for (int k = 0; k < 3; ++k) g.log_scales[k] = std::log(scale);
    g.opacity_logit = -3;
    for (auto& c : g.sh0) c = static_cast<float>(rng.normal());
    builder.add(g);
  };
  // Patches a tile wide, all of one depth or of so many: what a warp puts in order in one way, in the
  // other, and not.
  constexpr int kLengths[] = {1, 2, 33, 64, 65, 128, 129, 250, 256, 257, 500, 900};
  int column = 0;
  for (const int length : kLengths) {
    int row = 0;
    for (const int depths : {1, 2, 40, 100000}) {
      const double x = -1.7 + 0.3 * column, y = -0.9 + 0.5 * row;
      for (int i = 0; i < length; ++i) {
        const double z =
            2 + 0.001 * static_cast<double>(rng.next() % static_cast<std::uint64_t>(depths)) / depths;
        add(x + rng.uniform(-0.01, 0.01), y + rng.uniform(-0.01, 0.01), z, 0.003);
      }
      ++row;
    }
    ++column;
  }
  for (int i = 0; i < 3000; ++i)
    add(rng.uniform(-3, 3), rng.uniform(-2, 2), rng.uniform(1, 4), rng.uniform(0.01, 0.3));
  GaussianCloud cloud = builder.cloud();
  Camera camera;
  camera.set_hfov(is_emulated() ? 640 : 1280, is_emulated() ? 424 : 848, 90);
  REQUIRE(TileGrid::of(camera.width, camera.height, 16).count() > many_tiles());
  for (const bool sorted : {false, true}) {
    if (sorted) sort_spatially(cloud);
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    RenderConfig config;
    config.outputs = kAll;
    CudaBatchRenderer renderer(cuda);
    const Batch got = draw_batch(cuda, renderer, {arrays.set()}, {camera}, {}, kAll, false);
    check_same(got.frames, render<float>(serial, {cloud.set()}, camera, config));
    check_same(got.frames, singly(cuda, {arrays.set()}, {camera}, {}, {}, kAll));
  }
}

TEST_CASE("cuda batch: the same bits on every run, in any company") {
  if (no_gpu("cuda batch runs")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(21, {.count = 1500, .needle = 0.2});
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<Camera> cameras = ring(3, 40, 36);
  CudaBatchRenderer renderer(cuda);
  const Batch all = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianOnly);
  check_same(draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianOnly).frames, all.frames);
  const std::vector<Camera> last{cameras[2]};
  const Batch alone = draw_batch(cuda, renderer, {arrays.set()}, last, {}, kMedianOnly);
  const std::vector<float> third(all.frames.rgb.end() - 3 * 40 * 36, all.frames.rgb.end());
  CHECK(differing(alone.frames.rgb, third) == 0);
  // In a batch so large that tiles are of 16 pixels and each is one block's.
  std::vector<Camera> crowd = ring(many_tiles() / 9, 40, 36);
  crowd[7] = cameras[2];
  const Batch many = draw_batch(cuda, renderer, {arrays.set()}, crowd, {}, kMedianOnly);
  const auto seventh = [&](const std::vector<float>& image, std::ptrdiff_t channels) {
    const auto from = image.begin() + 7 * channels * 40 * 36;
    return std::vector<float>(from, from + channels * 40 * 36);
  };
  CHECK(differing(alone.frames.rgb, seventh(many.frames.rgb, 3)) == 0);
  CHECK(differing(alone.frames.median_depth, seventh(many.frames.median_depth, 1)) == 0);
  check_same(draw_batch(cuda, renderer, {arrays.set()}, crowd, {}, kMedianOnly).frames, many.frames);
}

TEST_CASE("cuda batch: an empty view, no sets, and what cannot be drawn") {
  if (no_gpu("cuda batch states")) return;
  CudaBackend cuda;
  const GaussianCloud cloud = random_cloud(8, {.count = 500});
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const Camera away = Camera::look_at({0, 0, 0}, {0, 0, -4}, {0, -1, 0}, 40, 30, 70);
  RenderConfig config;
  config.background = {0.25, 0.5, 0.75};
  CudaBatchRenderer renderer(cuda, config);
  for (const bool empty : {false, true}) {
    const std::vector<GaussianSet> sets =
        empty ? std::vector<GaussianSet>{} : std::vector<GaussianSet>{arrays.set()};
    const Batch f = draw_batch(cuda, renderer, sets, {away, away}, {}, kMedianOnly);
    CHECK(f.frames.rgb[1] == 0.5f);
    CHECK(f.frames.alpha.back() == 0.0f);
    CHECK(f.frames.median_depth.back() == 0.0f);
    CHECK(f.rgb8[0] == 64);
    CHECK(f.rgb8[2] == 191);
  }
  const std::vector<GaussianSet> sets{arrays.set()};
  const auto message = [&](const std::vector<BatchCamera>& cameras) {
    const Status s = renderer.render(sets, cameras, {});
    CHECK_FALSE(s.ok());
    return s.message();
  };
  Camera wide = away;
  wide.width = 41;
  const std::vector<std::uint32_t> beyond{0, 1};
  CHECK(message({}).find("no camera") != std::string::npos);
  CHECK(message({{away, {}}, {wide, {}}}).find("cameras[1]") != std::string::npos);
  CHECK(message({{away, beyond}}).find("sets has 1") != std::string::npos);
}
#else
TEST_CASE("cuda batch") { std::printf("SKIP: cuda batch: built without CUDA\n"); }
#endif
