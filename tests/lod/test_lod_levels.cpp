// SPDX-License-Identifier: Apache-2.0
// Levels that a set ships: what is where, how far it is off, and what is drawn of them.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/detail/eval/oracle_photo.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "level_support.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

const std::vector<LodLevel>& wall_levels() {
  static const std::vector<LodLevel> levels = shipped_levels(small_wall(31, 30000), 3);
  return levels;
}

LeveledCloud joined() {
  SerialBackend backend;
  return join_levels(backend, wall_levels(), 16).value();
}

/// Rows of a node, less those that fill its last chunk.
std::vector<std::size_t> rows_of(const LodBox& box) {
  std::vector<std::size_t> rows(box.rows);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = box.first_chunk * kProjectChunk + i;
  return rows;
}

}  // namespace

TEST_CASE(
    "lod levels: each node has the rows of its box and level, each once, and nothing else is seen") {
  const std::vector<LodLevel>& levels = wall_levels();
  const LeveledCloud set = joined();
  REQUIRE(set.tree.levels() == 4);
  REQUIRE(set.tree.roots.size() == 16);
  REQUIRE(set.tree.cloud_chunks() == set.cloud.view().chunk_count());
  std::vector<int> seen(set.cloud.size());
  std::size_t real = 0;
  for (std::size_t node = 0; node < set.tree.leaves(); ++node) {
    const LodBox& box = set.tree.boxes[node];
    CHECK(box.finer == LodBox::kNone);
    CHECK(box.shown == box.rows);
    std::uint32_t number = 99;
    for (const std::size_t row : rows_of(box)) {
      const std::uint32_t id = set.cloud.row_ids[row];
      REQUIRE(id < levels[0].cloud.size());
      if (number == 99) number = levels[0].boxes[id];
      CHECK(levels[0].boxes[id] == number);
      CHECK(set.cloud.mean(row) == levels[0].cloud.mean(id));
      CHECK(set.cloud.scales[1][row] == levels[0].cloud.scales[1][id]);
      CHECK(set.cloud.quats[2][row] == levels[0].cloud.quats[2][id]);
      CHECK(set.cloud.sh0[3 * row + 1] == levels[0].cloud.sh0[3 * id + 1]);
      CHECK(set.cloud.shN[9 * row + 8] == levels[0].cloud.shN[9 * id + 8]);
      CHECK(set.cloud.opacities[row] == levels[0].cloud.opacities[id]);
      ++seen[id];
      ++real;
    }
    for (std::size_t i = box.rows; i < box.chunks * kProjectChunk; ++i) {
      const std::size_t row = box.first_chunk * kProjectChunk + i;
      CHECK(set.cloud.opacities[row] == 0);
      ++seen[set.cloud.row_ids[row]];
    }
  }
  CHECK(real == levels[0].cloud.size());
  CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
  // Coarser nodes: as many rows as the level has of the box, and bounds around all that they stand for.
  std::size_t merged = 0;
  for (std::size_t node = set.tree.leaves(); node < set.tree.nodes.size(); ++node) {
    const LodBox& box = set.tree.boxes[node];
    const LodNode& finer = set.tree.nodes[box.finer];
    merged += box.rows;
    CHECK(set.tree.nodes[node].error >= finer.error);
    for (int k = 0; k < 3; ++k) {
      CHECK(set.tree.nodes[node].reach.low[k] <= finer.reach.low[k]);
      CHECK(set.tree.nodes[node].reach.high[k] >= finer.reach.high[k]);
    }
    for (const std::size_t row : rows_of(box)) CHECK(set.tree.merged.opacities[row] > 0);
  }
  CHECK(merged == levels[1].cloud.size() + levels[2].cloud.size() + levels[3].cloud.size());
}

TEST_CASE("lod levels: a node's error is that of trying all pairs") {
  const std::vector<LodLevel>& levels = wall_levels();
  const LeveledCloud set = joined();
  for (const std::size_t l : {1u, 3u}) {
    for (const std::uint32_t box : {0u, 6u}) {
      // Of each box one node a level, in the order of boxes.
      std::size_t node = set.tree.level_begin[l] + box;
      double squares = 0, mass = 0;
      for (std::size_t i = 0; i < levels[0].cloud.size(); ++i) {
        if (levels[0].boxes[i] != box) continue;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < levels[l].cloud.size(); ++k) {
          if (levels[l].boxes[k] != box) continue;
          const Vec3d d = levels[0].cloud.mean(i) - levels[l].cloud.mean(k);
          least = std::min(least, dot(d, d));
        }
        // These face the camera: sigma_x sigma_y is what they cover, but for what their edges add.
        const auto s = [&](std::size_t axis) {
          return static_cast<double>(levels[0].cloud.scales[axis][i]);
        };
        const double area =
            std::sqrt(s(0) * s(0) * s(1) * s(1) + s(0) * s(0) * s(2) * s(2) + s(1) * s(1) * s(2) * s(2));
        const double m = static_cast<double>(levels[0].cloud.opacities[i]) * area;
        squares += m * least;
        mass += m;
      }
      const double error = static_cast<double>(set.tree.nodes[node].error);
      CAPTURE(l);
      CAPTURE(box);
      if (l == 1) CHECK(error == doctest::Approx(std::sqrt(squares / mass)).epsilon(1e-5));
      CHECK(error >= std::sqrt(squares / mass) * (1 - 1e-5));
      CHECK(error > 0.005);
      CHECK(error < 0.2);
    }
  }
}

TEST_CASE("lod levels: the finest cut has the bits of the finest level, as any scene is drawn") {
  const LeveledCloud set = joined();
  GaussianCloud finest = wall_levels()[0].cloud;
  sort_spatially(finest);
  OpenMPBackend backend(2);
  BasicRenderer<float, OpenMPBackend> renderer(backend);
  LodCut cut(set.tree, set.cloud);
  LodChoice choice;
  choice.pixels = 1e-9;
  for (const double z : {-2.0, 1.5}) {
    const Camera camera = Camera::look_at({0.3, 0, z}, {0.5, 0, 4}, {0, -1, 0}, 96, 64, 60);
    const auto a = renderer.render(cut.select(camera, choice), std::span(&camera, 1)).value();
    const auto b = renderer.render(LodCut::photo_set(finest, choice), camera).value();
    CHECK(a.rgb == b.rgb);
    CHECK(a.alpha == b.alpha);
    CHECK(a.median_depth == b.median_depth);
    CHECK(cut.merged_chunks().empty());
    CHECK(cut.stats().merged == 0);
  }
}

TEST_CASE("lod levels: any cut shows each box in view once, and the same for any number of threads") {
  const LeveledCloud set = joined();
  Rng rng(32);
  LodCut cut(set.tree, set.cloud);
  bool mixed = false;
  for (int run = 0; run < 60; ++run) {
    const Vec3d eye{2 * rng.uniform(-1, 1), 2 * rng.uniform(-1, 1), rng.uniform(-6, 3.5)};
    const Camera camera =
        Camera::look_at(eye, {rng.uniform(-2, 2), rng.uniform(-2, 2), 4}, {0, -1, 0}, 64, 64, 60);
    LodChoice choice;
    choice.pixels = std::exp(rng.uniform(-2, 3));
    static_cast<void>(cut.select(camera, choice));
    std::vector<int> leaf(set.cloud.view().chunk_count()), merged(set.tree.merged.view().chunk_count());
    for (const std::uint32_t c : cut.leaf_chunks()) ++leaf[c];
    for (const std::uint32_t c : cut.merged_chunks()) ++merged[c];
    const auto p = make_projection_camera<double>(camera, LodCut::photo_set(set.cloud, choice));
    std::uint64_t shown = 0;
    for (std::uint32_t node : set.tree.roots) {
      int times = 0;
      const bool visible = may_be_visible(p, set.tree.nodes[node].reach);
      std::uint32_t finest = node;
      for (std::uint32_t n = node; n != LodBox::kNone; n = set.tree.boxes[n].finer) {
        const LodBox& box = set.tree.boxes[n];
        const std::vector<int>& of = box.finer == LodBox::kNone ? leaf : merged;
        int drawn = 0;
        for (std::uint32_t c = 0; c < box.chunks; ++c) drawn += of[box.first_chunk + c];
        CHECK((drawn == 0 || drawn == static_cast<int>(box.chunks)));
        times += drawn != 0 ? 1 : 0;
        shown += drawn != 0 ? box.shown : 0;
        finest = n;
      }
      CHECK(times <= 1);
      if (times == 0) CHECK((!visible || !may_be_visible(p, set.tree.nodes[finest].reach)));
    }
    CHECK(cut.stats().shown == shown);
    mixed = mixed || (!cut.leaf_chunks().empty() && !cut.merged_chunks().empty());
  }
  CHECK(mixed);
  OpenMPBackend threads(3);
  const LeveledCloud other = join_levels(threads, wall_levels(), 16).value();
  CHECK(other.cloud.means == set.cloud.means);
  CHECK(other.cloud.row_ids == set.cloud.row_ids);
  CHECK(other.tree.merged.shN == set.tree.merged.shN);
  for (std::size_t i = 0; i < set.tree.nodes.size(); ++i)
    CHECK(other.tree.nodes[i].error == set.tree.nodes[i].error);
}

TEST_CASE(
    "lod levels: a cut is never farther from the photo than its coarsest level, nor than direct "
    "rendering") {
  const LeveledCloud set = joined();
  OpenMPBackend backend;
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  LodCut cut(set.tree, set.cloud);
  const GaussianSet whole = set.cloud.set();
  bool fewer = false;
  for (const double z : {-5.0, -1.0, 2.0}) {
    for (const double x : {-1.5, 0.5}) {
      const Camera camera = Camera::look_at({x, 0.2, z}, {0.8, 0, 4}, {0, -1, 0}, 40, 40, 60);
      const auto truth = eval::oracle_photo(backend, std::span(&whole, 1), camera, 4).value();
      const auto quality = [&](std::span<const GaussianSet> sets) {
        return image_error(truth.rgb, renderer.render(sets, std::span(&camera, 1)).value().rgb, 3).psnr;
      };
      const double direct = quality(std::span(&whole, 1));
      for (const double pixels : {0.3, 1.0, 2.0}) {
        LodChoice choice;
        choice.pixels = pixels;
        const std::vector<GaussianSet> sets = [&] {
          const auto chosen = cut.select(camera, choice);
          return std::vector<GaussianSet>(chosen.begin(), chosen.end());
        }();
        const double own = quality(sets);
        // One level: the coarsest that the cut has, of every box.
        std::size_t coarsest = 0;
        for (std::size_t node = 0; node < set.tree.nodes.size(); ++node) {
          const LodBox& box = set.tree.boxes[node];
          const auto& chunks = box.finer == LodBox::kNone ? cut.leaf_chunks() : cut.merged_chunks();
          if (std::find(chunks.begin(), chunks.end(), box.first_chunk) == chunks.end()) continue;
          for (std::size_t l = 0; l < set.tree.levels(); ++l) {
            if (node >= set.tree.level_begin[l]) coarsest = std::max(coarsest, l);
          }
        }
        std::vector<std::uint32_t> level;
        for (std::size_t n = set.tree.level_begin[coarsest]; n < set.tree.level_begin[coarsest + 1];
             ++n) {
          for (std::uint32_t c = 0; c < set.tree.boxes[n].chunks; ++c)
            level.push_back(set.tree.boxes[n].first_chunk + c);
        }
        GaussianSet one = LodCut::photo_set(coarsest == 0 ? set.cloud : set.tree.merged, choice);
        one.selection.drawn_chunks = {level.data(), level.size()};
        CAPTURE(z);
        CAPTURE(x);
        CAPTURE(pixels);
        CAPTURE(coarsest);
        CHECK(own >= quality(std::span(&one, 1)));
        if (pixels <= 1) CHECK(own >= direct);
        fewer = fewer || (pixels <= 1 && 2 * cut.stats().drawn < cut.stats().shown);
      }
    }
  }
  CHECK(fewer);
}

TEST_CASE("lod levels: boxes without a level, and what makes no sense") {
  SerialBackend backend;
  std::vector<LodLevel> levels = wall_levels();
  // Box 3 has its finest level alone, box 5 lacks the second, box 7 nothing at the finest: it is not
  // shown at all.
  const auto without = [&](std::size_t l, std::uint32_t box) {
    LodLevel& level = levels[l];
    const std::vector<std::uint32_t> boxes = level.boxes;
    filter_rows(level.cloud, [&](std::size_t i) { return boxes[i] != box; });
    level.boxes.erase(std::remove(level.boxes.begin(), level.boxes.end(), box), level.boxes.end());
  };
  for (const std::size_t l : {1u, 2u, 3u}) without(l, 3);
  without(1, 5);
  without(0, 7);
  const LeveledCloud set = join_levels(backend, levels, 20).value();
  CHECK(set.tree.roots.size() == 15);
  CHECK(set.tree.nodes.size() == 15 * 4 - 3 - 1);
  CHECK(set.tree.cloud_chunks() == set.cloud.view().chunk_count());
  const auto refused = [&](std::vector<LodLevel> bad, std::size_t boxes, const char* part) {
    const auto result = join_levels(backend, std::move(bad), boxes);
    CAPTURE(result.message());
    CHECK(result.code() == Errc::invalid_argument);
    CHECK(result.message().find(part) != std::string::npos);
  };
  refused({}, 16, "no level");
  refused(levels, 15, "box 15 of 15");
  levels[2].boxes.pop_back();
  refused(levels, 16, "level 2");
  levels = wall_levels();
  compact_sh(levels[1].cloud);
  refused(levels, 16, "compact");
  levels = wall_levels();
  levels[2].cloud.filter = Filter::mip;
  refused(levels, 16, "filters");
  // 5000 boxes of one row each would be filled up to 256 times their size.
  LodLevel specks;
  specks.cloud = random_cloud(33, {.count = 5000, .sh_degree = 0});
  for (std::uint32_t b = 0; b < specks.cloud.size(); ++b) specks.boxes.push_back(b);
  CHECK(join_levels(backend, {specks}, specks.boxes.size()).code() == Errc::unsupported);
  const LeveledCloud none = join_levels(backend, std::vector<LodLevel>(2), 0).value();
  CHECK(none.cloud.size() == 0);
  LodCut cut(none.tree, none.cloud);
  CHECK(cut.select(Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 8, 8, 60)).empty());
}
