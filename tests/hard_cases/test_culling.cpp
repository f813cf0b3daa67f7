// SPDX-License-Identifier: Apache-2.0
// Rows sorted in space, chunks left out by their bounds: neither shows.
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "arrays.hpp"
#include "backends.hpp"
#include "cases.hpp"
#include "gsnav/detail/render/count_culled.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

Camera camera_anywhere(Rng& rng) {
  const auto in = [&](double r) {
    return Vec3d{rng.uniform(-r, r), rng.uniform(-r, r), rng.uniform(-r, r)};
  };
  const Vec3d eye = in(6), target = eye + in(1) + Vec3d{0, 0, 0.1};
  Camera c = Camera::look_at(eye, target, {0.1, 1, 0.05}, 48, 40, rng.uniform(20, 120));
  c.cx += rng.uniform(-60, 60);  // also outside the image
  c.cy += rng.uniform(-60, 60);
  c.near_plane = rng.uniform() < 0.5 ? 0.01 : 1.0;
  c.near_sigma = rng.uniform() < 0.5 ? 0.0 : 1.0;
  return c;
}

}  // namespace

TEST_CASE("N65_cull_invariance of chunks in space") {
  // A cloud much larger than the view, with needles of any length and grazing ones at its edges.
  GaussianCloud cloud = random_cloud(651, {.count = 15000,
                                           .sh_degree = 1,
                                           .needle = 0.002,
                                           .scale = 0.02,
                                           .center = {0, 0, 0},
                                           .extent = 6});
  REQUIRE(append(cloud, random_cloud(652, {.count = 60,
                                           .sh_degree = 1,
                                           .needle = 0.5,
                                           .scale = 1.0,
                                           .center = {0, 0, 0},
                                           .extent = 9}))
              .ok());
  for (const bool mip : {false, true}) {
    cloud.filter = mip ? Filter::mip : Filter::classic;
    const GaussianCloud in_chunks = sorted(cloud);
    REQUIRE(in_chunks.chunk_bounds.size() == in_chunks.view().chunk_count());
    REQUIRE(in_chunks.part_bounds.size() == (in_chunks.size() + kChunkPart - 1) / kChunkPart);
    std::size_t left_out = 0, chunks = 0, parts_left_out = 0;
    Rng rng(653);
    for (int i = 0; i < 12; ++i) {
      const Camera camera = camera_anywhere(rng);
      RenderConfig config = all_outputs();
      config.response = static_cast<Response>(i % 3);
      config.sort_order = i % 2 == 0 ? SortOrder::z_depth : SortOrder::camera_distance;
      config.quality.alpha_min = i % 4 == 3 ? 0.1 : 1.0 / 255;
      Similarity place;
      if (i % 2 == 1) place = {{0.8, 0.2, -0.5, 0.26457513110645907}, {0.3, -0.2, 0.5}, 2.5};
      const auto c64 =
          make_projection_camera<double>(camera, in_chunks.set(place), projection_rules(config));
      for (const ChunkBounds& b : in_chunks.chunk_bounds) left_out += may_be_visible(c64, b) ? 0 : 1;
      chunks += in_chunks.chunk_bounds.size();
      for (std::size_t p = 0; p < in_chunks.part_bounds.size(); ++p) {
        const ChunkBounds& chunk = in_chunks.chunk_bounds[p * kChunkPart / kProjectChunk];
        parts_left_out += may_be_visible(c64, chunk) && !lies_in_view(c64, chunk) &&
                                  !may_be_visible(c64, in_chunks.part_bounds[p])
                              ? 1
                              : 0;
      }
      for_each_renderer([&](auto& renderer) {
        const auto a = renderer.render({{&cloud, place}}, camera, config);
        const auto b = renderer.render({{&in_chunks, place}}, camera, config);
        CAPTURE(i);
        CAPTURE(renderer.name());
        if (!a.stats.empty()) {
          CHECK(a.stats[0].visible == b.stats[0].visible);
          CHECK(a.stats[0].tile_intersections == b.stats[0].tile_intersections);
        }
        CHECK(same_images(a, b));
      });
    }
    CHECK(left_out > chunks / 5);  // or nothing was tested
    CHECK(parts_left_out > chunks / 20);
  }
}

TEST_CASE("count_culled: what single Gaussians and boxes say, each by itself") {
  GaussianCloud cloud = sorted(random_cloud(
      655,
      {.count = 1200, .sh_degree = 0, .needle = 0.05, .scale = 0.3, .center = {0, 0, 0}, .extent = 6}));
  SerialBackend backend;
  BasicRenderer<float, SerialBackend> renderer(backend);
  Rng rng(656);
  std::uint64_t emitting = 0;
  for (int i = 0; i < 6; ++i) {
    Camera camera = camera_anywhere(rng);
    RenderConfig config;
    config.quality.alpha_min = i % 2 == 0 ? 1.0 / 255 : 0.1;
    config.tuning.tile_size = i % 3 == 0 ? 8 : 16;
    const GaussianSet set = cloud.set();
    const CullCounts n = count_culled(backend, std::span(&set, 1), camera, config);
    renderer.set_config(config);
    // A frame of each Gaussian alone: its pairs are the frame's.
    CullCounts want;
    want.rows = cloud.size();
    for (std::size_t row = 0; row < cloud.size(); ++row) {
      GaussianCloud one = cloud;
      filter_rows(one, [row](std::size_t r) { return r == row; });
      const auto frame = renderer.render(one.set(), camera).value();
      if (frame.stats[0].tile_intersections == 0) continue;
      record_hashes(frame, "serial float");
      ++want.emitting;
    }
    const auto c64 = make_projection_camera<double>(camera, set, projection_rules(config));
    for (std::size_t row = 0; row < cloud.size(); ++row) {
      const ChunkBounds& chunk = cloud.chunk_bounds[row / kProjectChunk];
      const bool whole =
          lies_in_view(c64, chunk) || may_be_visible(c64, cloud.part_bounds[row / kChunkPart]);
      want.touched += may_be_visible(c64, chunk) && whole ? 1 : 0;
    }
    CAPTURE(i);
    CHECK(n.rows == want.rows);
    CHECK(n.emitting == want.emitting);
    // Parts are tested with their chunk's largest opacity: a few more may be touched.
    CHECK(n.touched >= want.touched);
    CHECK(n.touched <= want.touched + 2 * kChunkPart);
    CHECK(n.removed() + n.touched == n.removable() + n.emitting);
    emitting += n.emitting;
  }
  CHECK(emitting > 80);
  const CullCounts none = count_culled(backend, {}, axis_camera(), {});
  CHECK(none.rows == 0);
  CHECK(none.touched_per_emitting() == 1);
}

TEST_CASE("N21_depth_ties_keep_file_order when rows are sorted in space") {
  // Layers that face the camera: whole runs of equal depth, in two sets, one of them moved.
  Rng rng(211);
  GaussianCloudBuilder builder(0), second(0);
  for (int i = 0; i < 1500; ++i) {
    RawGaussian g;
    g.mean = {rng.uniform(-1, 1), rng.uniform(-1, 1), 2.0 + 0.25 * static_cast<double>(i % 3)};
    g.quat = {1, 0, 0, 0};
    g.log_scales = {-2.5, -2.5, -6};
    g.opacity_logit = 1;
    for (auto& c : g.sh0) c = static_cast<float>(rng.normal());
    (i % 5 == 0 ? second : builder).add(g);
  }
  const GaussianCloud first = builder.cloud(), other = second.cloud();
  const GaussianCloud first_sorted = sorted(first), other_sorted = sorted(other);
  REQUIRE(!std::is_sorted(first_sorted.row_ids.begin(), first_sorted.row_ids.end()));
  const Camera camera = axis_camera();
  for (const int bits : {32, 8}) {  // 8: hundreds of Gaussians a key
    RenderConfig config = all_outputs();
    config.quality.key_bits = bits;
    for_each_renderer([&](auto& renderer) {
      const auto reference = renderer.render({&first, &other}, camera, config);
      CHECK(same_images(reference, renderer.render({&first_sorted, &other_sorted}, camera, config)));
      CHECK(same_images(reference, renderer.render({&first, &other_sorted}, camera, config)));
      CHECK(same_images(reference, renderer.render({&first_sorted, &other}, camera, config)));
    });
  }
}

TEST_CASE("sort_spatially permutes rows whole") {
  GaussianCloud cloud =
      random_cloud(654, {.count = 1000, .sh_degree = 2, .center = {500, -70, 0}, .extent = 200});
  REQUIRE(!cloud.origin_ids.empty());
  const GaussianCloud s = sorted(sorted(cloud));  // twice: row ids are those of the file still
  REQUIRE(s.size() == cloud.size());
  std::vector<std::uint32_t> ids = s.row_ids;
  std::sort(ids.begin(), ids.end());
  std::vector<std::uint32_t> all(cloud.size());
  std::iota(all.begin(), all.end(), 0u);
  CHECK(ids == all);
  for (std::size_t i = 0; i < s.size(); ++i) {
    const std::size_t row = s.row_ids[i];
    CHECK(s.mean(i) == cloud.mean(row));
    CHECK(s.quats[2][i] == cloud.quats[2][row]);
    CHECK(s.scales[1][i] == cloud.scales[1][row]);
    CHECK(s.opacities[i] == cloud.opacities[row]);
    CHECK(s.sh0[3 * i + 1] == cloud.sh0[3 * row + 1]);
    CHECK(s.shN[24 * i + 23] == cloud.shN[24 * row + 23]);
    const ChunkBounds& b = s.chunk_bounds[i / kProjectChunk];
    for (int k = 0; k < 3; ++k) CHECK((s.mean(i)[k] >= b.low[k] && s.mean(i)[k] <= b.high[k]));
    CHECK(s.scales[0][i] <= b.scale_max);
    CHECK(s.opacities[i] <= b.opacity_max);
  }
  const std::size_t n = cloud.size();
  GaussianCloud merged = s;
  REQUIRE(append(merged, cloud).ok());
  CHECK(merged.chunk_bounds.empty());
  CHECK(merged.row_ids[n + 3] == n + 3);
  CHECK(merged.row_ids[5] == s.row_ids[5]);
}
