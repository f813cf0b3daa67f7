// SPDX-License-Identifier: Apache-2.0
// Batches of small images, which are drawn by lists of regions: the bits of one camera at a time.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ops/backends.hpp"
#include "support/scenes.hpp"

#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda/policy.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "ops/cuda_batch_images.hpp"
#include "ops/no_gpu.hpp"
#include "support/seen_rows.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kCameras = 130;
static_assert(kCameras >= cuda::policy::Regions::kLeastCameras);

/// Images of the cameras with these numbers.
Frames<float> of_cameras(const Frames<float>& all, const std::vector<std::size_t>& numbers) {
  Frames<float> out;
  const auto pick = [&](std::vector<float>& to, const std::vector<float>& from) {
    const std::size_t size = from.size() / kCameras;
    for (const std::size_t c : numbers) {
      const auto begin = from.begin() + static_cast<std::ptrdiff_t>(c * size);
      to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
    }
  };
  for_each_image(out, all, pick);
  return out;
}

/// Checks a batch against some of its cameras alone.
void check_some(CudaBackend& cuda, const Batch& got, const std::vector<GaussianSet>& sets,
                const std::vector<Camera>& cameras, const Lists& lists, const RenderConfig& config,
                unsigned outputs) {
  REQUIRE(got.stats.by_regions);
  std::vector<std::size_t> numbers;
  std::vector<Camera> some;
  Lists of_some;
  for (std::size_t c = 0; c < kCameras; c += 9) {
    numbers.push_back(c);
    some.push_back(cameras[c]);
    if (!lists.empty()) of_some.push_back(lists[c]);
  }
  check_same(of_cameras(got.frames, numbers), singly(cuda, sets, some, of_some, config, outputs));
}

/// Random unit quaternions in four planes, by which SH bands are turned.
Buffer<float, CudaBackend> rotations_of(CudaBackend& cuda, std::size_t count) {
  Rng rng(31);
  std::vector<float> planes(4 * count);
  for (std::size_t i = 0; i < count; ++i) {
    double parts[4], sum = 0;
    for (double& p : parts) p = rng.normal();
    for (const double p : parts) sum += p * p;
    for (std::size_t k = 0; k < 4; ++k)
      planes[k * count + i] = static_cast<float>(parts[k] / std::sqrt(sum));
  }
  Buffer<float, CudaBackend> out(cuda);
  out.upload(planes.data(), planes.size());
  return out;
}

constexpr unsigned kSmallOutputs[] = {kMedianDepth, kRgb, kMedianOnly};

}  // namespace

TEST_CASE("cuda batch regions: several scenes, placed, in lists of each camera's own") {
  if (no_gpu("cuda batch regions")) return;
  CudaBackend cuda;
  const int count = is_emulated() ? 600 : 9000;
  GaussianCloud a = random_cloud(1, {.count = count, .needle = 0.3});
  GaussianCloud b = random_cloud(2, {.count = count / 3, .sh_degree = 1, .scale = 0.2});
  const GaussianCloud c =
      random_cloud(3, {.count = is_emulated() ? 350 : 700, .sh_degree = 0, .scale = 0.02, .mip = true});
  sort_spatially(a);
  sort_spatially(b);
  compact_sh(b);
  const GaussianArrays<CudaBackend> on_a(cuda, a), on_b(cuda, b), on_c(cuda, c);
  Similarity placed;
  placed.translation = {0.4, -0.2, 0.3};
  placed.scale = 0.7;
  std::vector<GaussianSet> sets{on_a.set(), on_b.set(), on_c.set(placed)};
  const Buffer<float, CudaBackend> turned = rotations_of(cuda, b.size());
  for (std::size_t k = 0; k < 4; ++k)
    sets[1].gaussians.color.rotations.data[k] = turned.data() + k * b.size();
  sets[1].gaussians.color.rotations.size = b.size();
  Lists lists;
  for (std::uint32_t i = 0; i < kCameras; ++i) {
    lists.push_back(i % 4 == 0   ? std::vector<std::uint32_t>{2, 0}
                    : i % 4 == 1 ? std::vector<std::uint32_t>{1}
                    : i % 4 == 2 ? std::vector<std::uint32_t>{}
                                 : std::vector<std::uint32_t>{0, 1, 2});
  }
  for (const auto& size : {std::pair{53, 37}, {64, 64}, {16, 9}}) {
    const int width = size.first, height = size.second;
    if (is_emulated() && width == 64) continue;
    const std::vector<Camera> cameras = ring(kCameras, width, height);  // Some have near_sigma.
    for (const Quality& quality : {Quality::exact(), Quality::fast()}) {
      if (is_emulated() && (quality == Quality::fast()) != (width == 53)) continue;
      RenderConfig config;
      config.quality = quality;
      config.background = {0.25, 0.5, 0.75};
      CudaBatchRenderer renderer(cuda, config);
      renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
      for (const unsigned outputs : kSmallOutputs) {
        if (is_emulated() && outputs == kRgb) continue;
        CAPTURE(width);
        CAPTURE(outputs);
        const Batch got = draw_batch(cuda, renderer, sets, cameras, lists, outputs, outputs == kRgb);
        check_some(cuda, got, sets, cameras, lists, config, outputs);
        // The same bits on every run.
        if (is_emulated()) continue;
        check_same(got.frames, draw_batch(cuda, renderer, sets, cameras, lists, outputs, false).frames);
      }
    }
  }
}

TEST_CASE("cuda batch regions: tiles that warps divide have the bits of whole ones") {
  if (no_gpu("cuda batch regions in parts")) return;
  CudaBackend cuda;
  // Faint rows in front of others, so that lists are long and pixels close at different rows.
  const int count = is_emulated() ? 1500 : 40000;
  GaussianCloud faint = faint_cloud(
      count, [](double z) { return 0.02 * z; },
      [](int, Rng& rng) {
        return Vec3d{1.5 * rng.uniform(-1, 1), 1.5 * rng.uniform(-1, 1), 4 + 1.5 * rng.uniform(-1, 1)};
      });
  GaussianCloud solid = random_cloud(9, {.count = count / 4, .sh_degree = 0});
  sort_spatially(faint);
  sort_spatially(solid);
  const GaussianArrays<CudaBackend> on_faint(cuda, faint), on_solid(cuda, solid);
  const std::vector<GaussianSet> sets{on_faint.set(), on_solid.set()};
  struct Least {
    std::uint32_t pairs, rows;
    bool always;
  };
  for (const auto& size : {std::pair{21, 13}, {64, 64}}) {
    if (is_emulated() && size.first == 64) continue;
    const std::vector<Camera> cameras = ring(kCameras, size.first, size.second);
    RenderConfig config;
    config.background = {0.25, 0.5, 0.75};
    CudaBatchRenderer renderer(cuda, config);
    renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
    for (std::size_t o = 0; o < std::size(kSmallOutputs); ++o) {
      const unsigned outputs = kSmallOutputs[o];
      CAPTURE(outputs);
      const auto draw = [&](const Least& least) {
        renderer.set_least_of_parts(least.pairs, least.rows, least.always);
        return draw_batch(cuda, renderer, sets, cameras, {}, outputs, outputs == kRgb);
      };
      const Batch whole = draw({64, 0, false});
      CHECK(whole.stats.parts_given == 0);
      check_some(cuda, whole, sets, cameras, {}, config, outputs);
      constexpr Least kLeasts[] = {{2, 0, true}, {9, 1, true}, {2, 100, true}, {2, 0, false}};
      for (std::size_t i = 0; i < std::size(kLeasts); ++i) {
        if (is_emulated() && i != 0 && i != o + 1) continue;  // each of the others with one output
        const Least& least = kLeasts[i];
        CAPTURE(least.pairs);
        CAPTURE(least.rows);
        const Batch divided = draw(least);
        if (least.always) CHECK(divided.stats.parts_given > 0);
        check_same(divided.frames, whole.frames);
        CHECK(divided.rgb8 == whole.rgb8);
      }
    }
  }
}

TEST_CASE("cuda batch regions: rows that need double, and more of them than have records") {
  if (no_gpu("cuda batch regions in double")) return;
  CudaBackend cuda;
  SerialBackend serial;
  // Needles as long as the view is wide: their centres lie far outside most images.
  for (const int count : {600, 24000}) {
    if (is_emulated() && count > 600) continue;
    GaussianCloud cloud = random_cloud(
        17,
        {.count = count, .sh_degree = 1, .needle = 1, .scale = 0.4, .center = {0, 0, 0}, .extent = 3});
    sort_spatially(cloud);
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    const std::vector<GaussianSet> sets{arrays.set()};
    std::vector<Camera> cameras = ring(kCameras, 40, 40);
    for (Camera& camera : cameras) {
      camera.fx *= 4;
      camera.fy *= 4;
    }
    const RenderConfig config;
    CudaBatchRenderer renderer(cuda, config);
    renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
    for (const unsigned outputs : {unsigned{kMedianDepth}, kRgb | kAlpha | kMedianDepth}) {
      const Batch got = draw_batch(cuda, renderer, sets, cameras, {}, outputs, false);
      check_some(cuda, got, sets, cameras, {}, config, outputs);
      RenderConfig of_one = config;
      of_one.outputs = outputs;
      check_same(of_cameras(got.frames, {3}), render<float>(serial, {cloud.set()}, cameras[3], of_one));
    }
  }
}

TEST_CASE("cuda batch regions: thousands of rows of one key are in order of rank") {
  if (no_gpu("cuda batch regions order")) return;
  CudaBackend cuda;
  SerialBackend serial;
  // Faint walls, so that pixels stay open: one of equal keys, one of few bins, and one far behind.
  GaussianCloud cloud = faint_cloud(
      is_emulated() ? 1000 : 24000, [](double z) { return 0.01 * z; },
      [](int i, Rng& rng) {
        const double z = i % 3 == 0   ? 2.0
                         : i % 3 == 1 ? 2 + 1e-4 * rng.uniform(0, 1)
                                      : rng.uniform(1, 28);
        const double spread = is_emulated() ? 0.03 * z : 0.2 * z;
        return Vec3d{spread * rng.uniform(-1, 1), spread * rng.uniform(-1, 1), z};
      });
  Camera camera;
  camera.set_hfov(48, 48, 60);
  camera.cx = camera.cy = 24;
  if (is_emulated()) camera.width = camera.height = 32;  // the walls are in the middle
  const std::vector<Camera> cameras(kCameras, camera);
  for (const bool sorted : {false, true}) {
    if (sorted) sort_spatially(cloud);
    if (is_emulated() && !sorted) continue;
    const GaussianArrays<CudaBackend> arrays(cuda, cloud);
    const RenderConfig config;
    CudaBatchRenderer renderer(cuda, config);
    renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
    const unsigned outputs = kMedianOnly;
    RenderConfig of_one = config;
    of_one.outputs = outputs;
    const Frames<float> one = render<float>(serial, {cloud.set()}, camera, of_one);
    for (const bool divided : {false, true}) {
      CAPTURE(divided);
      if (divided) renderer.set_least_of_parts(5, 0, true);
      const Batch got = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, outputs, false);
      REQUIRE(got.stats.by_regions);
      CHECK((got.stats.parts_given > 0 || !divided));
      check_same(of_cameras(got.frames, {0}), one);
      check_same(of_cameras(got.frames, {kCameras - 1}), one);
    }
  }
}

TEST_CASE("cuda batch regions: rows of few cameras are listed in parts") {
  if (no_gpu("cuda batch regions listed in parts")) return;
  CudaBackend cuda;
  GaussianCloud a = random_cloud(21, {.count = is_emulated() ? 9000 : 60000, .scale = 0.05});
  // Centres far outside most images, with records in double.
  GaussianCloud b = random_cloud(22, {.count = 600, .sh_degree = 1, .needle = 1, .scale = 0.4});
  sort_spatially(a);
  sort_spatially(b);
  const GaussianArrays<CudaBackend> on_a(cuda, a), on_b(cuda, b);
  const std::vector<GaussianSet> sets{on_a.set(), on_b.set()};
  const Camera away = Camera::look_at({0, 0, 50}, {0, 0, 90}, {0, -1, 0}, 40, 24, 60);
  for (const std::size_t seeing : {1u, 2u, 5u}) {  // 8, 4 and 2 times the share of a part, emulated.
    CAPTURE(seeing);
    std::vector<Camera> cameras(kCameras, away);
    const std::vector<Camera> some = ring(static_cast<int>(seeing), 40, 24);
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < seeing; ++i) {
      numbers.push_back(17 * i + 3);
      cameras[numbers.back()] = some[i];
    }
    const RenderConfig config;
    CudaBatchRenderer renderer(cuda, config);
    renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
    const Batch got = draw_batch(cuda, renderer, sets, cameras, {}, kMedianDepth, false);
    REQUIRE(got.stats.by_regions);
    check_same(of_cameras(got.frames, numbers), singly(cuda, sets, some, {}, config, kMedianDepth));
  }
}

TEST_CASE("cuda batch regions: visible sets of chunks and rows; depth against float64") {
  if (no_gpu("cuda batch regions of visible sets")) return;
  CudaBackend cuda;
  SerialBackend serial;
  GaussianCloud cloud = random_cloud(65, {.count = is_emulated() ? 3000 : 15050, .scale = 0.1});
  sort_spatially(cloud);
  const GaussianArrays<CudaBackend> arrays(cuda, cloud);
  const std::vector<Camera> cameras = ring(kCameras, 44, 36);
  const std::size_t words = (cloud.view().chunk_count() + 31) / 32;
  Rng rng(6);
  std::vector<std::uint32_t> bits;
  std::vector<std::size_t> begins{0};
  std::vector<GaussianCloud> rests;
  for (std::size_t c = 0; c < 3; ++c) {  // Rows, chunks alone, nothing known.
    std::vector<bool> may = random_rows(rng, cloud.size());
    if (c == 1) {
      for (std::size_t i = 0; i < may.size(); ++i) may[i] = may[i / kProjectChunk * kProjectChunk];
    }
    std::vector<std::uint32_t> of_camera = seen_words(may);
    if (c == 1) of_camera.resize(words);
    if (c == 2) {
      of_camera.clear();
      may.assign(may.size(), true);
    }
    rests.push_back(only_seen(cloud, may));
    bits.insert(bits.end(), of_camera.begin(), of_camera.end());
    begins.push_back(bits.size());
  }
  Buffer<std::uint32_t, CudaBackend> there(cuda);
  there.upload(bits.data(), bits.size());
  std::vector<std::vector<View<const std::uint32_t>>> seen;
  for (std::size_t c = 0; c < kCameras; ++c)
    seen.push_back({{there.data() + begins[c % 3], begins[c % 3 + 1] - begins[c % 3]}});
  CudaBatchRenderer renderer(cuda);
  renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
  const Batch got =
      draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianDepth, false, {}, seen);
  REQUIRE(got.stats.by_regions);
  RenderConfig config;
  config.outputs = kAlpha | kMedianDepth;
  for (std::size_t c = 0; c < (is_emulated() ? 3u : 12u); ++c) {
    const Frames<float> mine = of_cameras(got.frames, {c});
    const Frames<float> one = render<float>(serial, {rests[c % 3].set()}, cameras[c], config);
    CHECK(differing(mine.median_depth, one.median_depth) == 0);
    const Frames<double> truth = render<double>(serial, {rests[c % 3].set()}, cameras[c], config);
    std::vector<double> errors;
    for (std::size_t i = 0; i < truth.alpha.size(); ++i) {
      if (truth.alpha[i] > 0.9) errors.push_back(std::abs(mine.median_depth[i] - truth.median_depth[i]));
    }
    std::sort(errors.begin(), errors.end());
    if (!errors.empty()) CHECK(errors[errors.size() * 99 / 100] <= 1e-4);
  }
}

TEST_CASE("cuda batch regions: calls that they cannot draw are drawn by tiles, and scratch grows") {
  if (no_gpu("cuda batch regions limits")) return;
  CudaBackend cuda;
  // Splats as wide as the image: each row is in every region.
  const GaussianCloud wide = random_cloud(4, {.count = is_emulated() ? 300 : 40000, .scale = 2});
  const GaussianCloud far_apart = random_cloud(5, {.count = 300, .extent = 200});
  REQUIRE(!far_apart.origin_ids.empty());
  const GaussianArrays<CudaBackend> arrays(cuda, wide), of_origins(cuda, far_apart);
  const std::vector<Camera> cameras = ring(kCameras, 48, 48);
  CudaBatchRenderer renderer(cuda);
  renderer.set_least_of_regions(cuda::policy::Regions::kLeastCameras, 0);
  const Batch first = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianDepth, false);
  CHECK(first.stats.reruns > 0);
  check_some(cuda, first, {arrays.set()}, cameras, {}, {}, kMedianDepth);
  const Batch second = draw_batch(cuda, renderer, {arrays.set()}, cameras, {}, kMedianDepth, false);
  CHECK(second.stats.reruns == 0);
  check_same(first.frames, second.frames);
  const std::vector<Camera> few(cameras.begin(), cameras.begin() + 20);
  CHECK(!draw_batch(cuda, renderer, {arrays.set()}, few, {}, kMedianDepth, false).stats.by_regions);
  CHECK(!draw_batch(cuda, renderer, {of_origins.set()}, cameras, {}, kMedianDepth, false)
             .stats.by_regions);
  CHECK(!draw_batch(cuda, renderer, {of_origins.set()}, cameras, {}, kAll, false).stats.by_regions);
  const Batch empty = draw_batch(cuda, renderer, {}, cameras, {}, kMedianDepth, false);
  CHECK(!empty.stats.by_regions);
  CHECK(std::all_of(empty.frames.median_depth.begin(), empty.frames.median_depth.end(),
                    [](float z) { return z == 0; }));
  // No row is in view.
  std::vector<Camera> away(kCameras, Camera::look_at({0, 0, 50}, {0, 0, 90}, {0, -1, 0}, 32, 32, 60));
  const Batch nothing = draw_batch(cuda, renderer, {arrays.set()}, away, {}, kMedianDepth, false);
  CHECK(nothing.stats.by_regions);
  CHECK(std::all_of(nothing.frames.median_depth.begin(), nothing.frames.median_depth.end(),
                    [](float z) { return z == 0; }));
}

#else
TEST_CASE("cuda batch regions") { std::printf("SKIP: cuda batch regions: built without CUDA\n"); }
#endif
