// SPDX-License-Identifier: Apache-2.0
// What is seen from where: weights, cells, cuts.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <type_traits>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "level_support.hpp"
#include "lod_support.hpp"
#include "support/files.hpp"
#include "support/scenes.hpp"
#include "support/seen_rows.hpp"
#include "two_rooms.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

VisibleSettings coarse() {
  VisibleSettings s;
  s.face = 32;
  s.min_weight = 1e-3;  // the rooms' walls let a little light through
  return s;
}

const GaussianCloud& rooms() {
  static const GaussianCloud cloud = two_rooms(1);
  return cloud;
}

const VisibleSets& rooms_sets() {
  static const VisibleSets sets = [] {
    OpenMPBackend backend(2);
    return build_visible_sets(backend, rooms(), places_in_rooms(), coarse()).value();
  }();
  return sets;
}

/// A camera at a random place where viewpoints are, looking anywhere near the horizon.
Camera random_camera(Rng& rng) {
  const double left = rng.uniform(0, 1) < 0.5 ? -3.2 : 0.2;
  const double x = left + rng.uniform(0.5, 2.5), z = rng.uniform(-1, 1);
  const Vec3d eye{x, 1.3, z};
  const double yaw = rng.uniform(0, 6.3);
  return Camera::look_at(eye, eye + Vec3d{std::cos(yaw), rng.uniform(-0.4, 0.4), std::sin(yaw)},
                         {0, 1, 0}, 32, 32, 90);
}

GaussianSet seen_set(const GaussianCloud& cloud, const VisibleSets& sets, std::size_t cell) {
  GaussianSet s = cloud.set();
  s.selection.seen = sets.seen_from(cell);
  return s;
}

double psnr(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
  return sum == 0 ? 200.0 : -10 * std::log10(sum / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("row weights: of a few Gaussians, what an image of each alone in white shows, in double") {
  GaussianCloud cloud = small_wall(3, 1500, 0);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % 128 == 17) {
      kept.push_back(i);
      for (auto& s : cloud.scales) s[i] = 0.4f;
      cloud.opacities[i] = 0.6f;
    } else {
      cloud.opacities[i] = 0;
    }
  }
  bound_chunks(cloud);
  const Camera camera = Camera::look_at({0.3, -0.2, 0}, {0, 0, 4}, {0, -1, 0}, 50, 40, 80);
  OpenMPBackend backend(2);
  RowWeightsWorkspace<OpenMPBackend> workspace(backend);
  std::vector<float> most(cloud.size());
  REQUIRE(add_row_weights(backend, workspace, cloud.set(), camera, most).ok());

  SerialBackend serial;
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<double, SerialBackend> renderer(serial, config);
  int seen = 0;
  for (const std::size_t i : kept) {
    GaussianCloud white = cloud;
    std::fill(white.sh0.begin(), white.sh0.end(), -0.5f / 0.28209479177387814f);  // black
    for (std::size_t k = 0; k < 3; ++k) white.sh0[3 * i + k] = 0.5f / 0.28209479177387814f;
    const auto image = renderer.render(white.set(), camera).value().rgb;
    const double expected = *std::max_element(image.begin(), image.end());
    CHECK(static_cast<double>(most[i]) == doctest::Approx(expected).epsilon(2e-4));
    seen += expected > 0.01 ? 1 : 0;
    most[i] = 0;
  }
  CHECK(seen >= 6);
  CHECK(*std::max_element(most.begin(), most.end()) == 0);
  // Raised, not set.
  std::vector<float> above(most.size(), 2.0f);
  REQUIRE(add_row_weights(backend, workspace, cloud.set(), camera, above).ok());
  CHECK(above == std::vector<float>(most.size(), 2.0f));
  CHECK(add_row_weights(backend, workspace, cloud.set(), camera, std::span(above).first(1)).code() ==
        Errc::invalid_argument);
}

TEST_CASE("row weights: the same bits in lanes and without, in slices of depth and without") {
  SerialBackend serial;
  OpenMPBackend one(1), three(3);
  RowWeightsWorkspace<SerialBackend> generic(serial);
  RowWeightsWorkspace<OpenMPBackend> alone(one), together(three);
  const GaussianCloud cloud = two_rooms(2, 4000);
  const std::vector<Vec3d> eyes = places_in_rooms();
  for (const Camera& camera : detail::cube_cameras(eyes[3], 1, 22, 0.2, 0)) {  // no whole blocks
    std::vector<float> a(cloud.size()), b(a.size()), c(a.size());
    REQUIRE(add_row_weights(serial, generic, cloud.set(), camera, a).ok());
    REQUIRE(add_row_weights(one, alone, cloud.set(), camera, b).ok());
    REQUIRE(add_row_weights(three, together, cloud.set(), camera, c).ok());
    CHECK(a == b);
    CHECK(a == c);
    CHECK(std::count_if(a.begin(), a.end(), [](float w) { return w > 1e-3f; }) > 20);
    CHECK(alone.render.slices.count() > 1);
  }
}

TEST_CASE(
    "rows that may be seen are drawn as if the others were transparent: whole, in lanes, in slices, in "
    "double") {
  Rng rng(31);
  GaussianCloud cloud = random_cloud(
      71,
      {.count = 9007, .sh_degree = 1, .needle = 0.02, .scale = 0.03, .center = {0, 0, 0}, .extent = 5});
  sort_spatially(cloud);
  OpenMPBackend lanes(2);
  SerialBackend serial;
  for (int i = 0; i < 4; ++i) {
    const std::vector<bool> may = random_rows(rng, cloud.size());
    const std::vector<std::uint32_t> words = seen_words(may);
    const GaussianCloud rest = only_seen(cloud, may);
    GaussianSet set = cloud.set();
    set.selection.seen = {words.data(), words.size()};
    const double yaw = rng.uniform(0, 6.3);
    const Camera camera =
        Camera::look_at({0, 0, 0}, {std::cos(yaw), 0.2, std::sin(yaw)}, {0, 1, 0}, 60, 44, 80);
    RenderConfig config;
    config.outputs = kRgb | kAlpha | kMedianDepth;
    const auto same = [&](auto& backend, auto scalar) {
      BasicRenderer<decltype(scalar), std::remove_reference_t<decltype(backend)>> renderer(backend,
                                                                                           config);
      const auto part = renderer.render(set, camera).value(),
                 want = renderer.render(rest.set(), camera).value();
      CHECK(part.rgb == want.rgb);
      CHECK(part.alpha == want.alpha);
      CHECK(part.median_depth == want.median_depth);
      CHECK(*std::max_element(part.alpha.begin(), part.alpha.end()) > 0.3);
    };
    for (const int slices : {1, 3}) {
      config.tuning.depth_slices = slices;
      same(lanes, 0.0f);
    }
    config.response = Response::ray;  // without lanes
    same(lanes, 0.0f);
    config.response = Response::ewa;
    same(serial, 0.0f);
    same(serial, 0.0);
  }
  GaussianSet set = cloud.set();
  const std::vector<std::uint32_t> words = seen_words(std::vector<bool>(cloud.size(), true));
  const auto render = [&] {
    return BasicRenderer<float, SerialBackend>(serial, {})
        .render(set, Camera::look_at({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 8, 8, 80));
  };
  set.selection.seen = {words.data(), words.size()};
  CHECK(render().status().ok());
  set.selection.seen.size = words.size() - 1;
  CHECK(render().code() == Errc::invalid_argument);
  CHECK(contains(render().message(), "seen"));
}

TEST_CASE("visible sets: rows in runs hold what single ones do, and chunks are those of both") {
  OpenMPBackend backend(2);
  const std::vector<Vec3d> eyes = places_in_rooms();
  const auto made = [&](int rows) {
    VisibleSettings s = coarse();
    s.rows = rows;
    return build_visible_sets(backend, rooms(), std::span(eyes).first(6), s).value();
  };
  const VisibleSets chunks = made(0), ones = made(1), runs = made(8);
  const std::size_t words = chunks.words();
  std::size_t some = 0;
  REQUIRE(ones.keys == chunks.keys);
  REQUIRE(runs.keys == chunks.keys);
  for (std::size_t c = 0; c < chunks.cells(); ++c) {
    REQUIRE(chunks.seen_from(c).size == words);
    REQUIRE(ones.seen_from(c).size == 2 * words + kSeenRowWords * chunks.count_seen(c));
    const Selection a{{}, ones.seen_from(c)}, b{{}, runs.seen_from(c)};
    std::size_t rows = 0;
    for (std::size_t chunk = 0; chunk < chunks.cloud_chunks; ++chunk) {
      const bool seen = (chunks.seen_from(c)[chunk / 32] >> (chunk % 32) & 1) != 0;
      CHECK(a.may_be_seen(chunk) == seen);
      CHECK(b.may_be_seen(chunk) == seen);
      if (!seen) continue;
      const SeenRows of_ones = a.seen_rows(chunks.cloud_chunks, chunk),
                     of_runs = b.seen_rows(chunks.cloud_chunks, chunk);
      const std::size_t size = std::min(kProjectChunk, rooms().size() - chunk * kProjectChunk);
      for (std::size_t r = 0; r < kProjectChunk; ++r) {
        bool any = false;
        for (std::size_t k = r / 8 * 8; k < r / 8 * 8 + 8; ++k) any = any || of_ones.has(k);
        CHECK(of_runs.has(r) == (any && r < size));
        rows += of_ones.has(r) ? 1 : 0;
      }
    }
    CHECK(ones.count_seen_rows(c, rooms().size()) == rows);
    CHECK(rows <= runs.count_seen_rows(c, rooms().size()));
    some += rows < runs.count_seen_rows(c, rooms().size()) ? 1 : 0;
    CHECK(runs.count_seen_rows(c, rooms().size()) < chunks.count_seen_rows(c, rooms().size()));
  }
  CHECK(some > 0);
}

TEST_CASE("visible sets: what is behind a wall is left out, and no image shows it") {
  const VisibleSets& sets = rooms_sets();
  OpenMPBackend backend(2);
  RenderConfig config;
  config.outputs = kRgb;
  config.quality.exponential = Exponential::fast;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  config.tuning.depth_slices = 3;
  BasicRenderer<float, OpenMPBackend> sliced(backend, config);
  Rng rng(5);
  int known = 0, hidden = 0;
  for (int i = 0; i < 30; ++i) {
    const Camera camera = random_camera(rng);
    const auto cell = sets.cell_of(camera);
    if (!cell) continue;
    ++known;
    // Chunks of the other room alone are not seen.
    const double side = camera.position().x < 0 ? -1 : 1;
    for (std::size_t c = 0; c < sets.cloud_chunks; ++c) {
      const ChunkBounds& b = rooms().chunk_bounds[c];
      if (std::max(side * b.low.x, side * b.high.x) > -0.3) continue;
      ++hidden;
      CHECK_FALSE((sets.seen_from(*cell)[c / 32] >> (c % 32) & 1) != 0);
    }
    const auto whole = renderer.render(rooms().set(), camera).value().rgb;
    const auto part = renderer.render(seen_set(rooms(), sets, *cell), camera).value().rgb;
    CHECK(psnr(whole, part) > 60);
    CHECK(sliced.render(seen_set(rooms(), sets, *cell), camera).value().rgb == part);
  }
  CHECK(known > 20);
  CHECK(hidden > 2 * known);
}

TEST_CASE("visible sets: a further viewpoint takes nothing away, and adds") {
  OpenMPBackend backend(2);
  VisibleSettings settings = coarse();
  settings.rows = 1;
  const std::vector<Vec3d> eyes{{1.1, 1.3, 0.1}, {1.4, 1.3, 0.4}};  // of one cell
  const VisibleSets one =
      build_visible_sets(backend, rooms(), std::span(eyes).first(1), settings).value();
  const VisibleSets both = build_visible_sets(backend, rooms(), eyes, settings).value();
  const auto at = std::lower_bound(both.keys.begin(), both.keys.end(), one.keys[0]);
  REQUIRE(at != both.keys.end());
  REQUIRE(*at == one.keys[0]);
  const std::size_t cell = static_cast<std::size_t>(at - both.keys.begin());
  const Selection a{{}, one.seen_from(0)}, b{{}, both.seen_from(cell)};
  const std::size_t chunks = rooms().view().chunk_count();
  std::size_t more = 0;
  for (std::size_t i = 0; i < rooms().size(); ++i) {
    const auto seen = [i, chunks](const Selection& v) {
      return v.may_be_seen(i / kProjectChunk) &&
             v.seen_rows(chunks, i / kProjectChunk).has(i % kProjectChunk);
    };
    if (seen(a)) CHECK(seen(b));
    more += !seen(a) && seen(b) ? 1 : 0;
  }
  CHECK(more > 0);
}

TEST_CASE("visible sets: the same bits for any number of threads") {
  SerialBackend one;
  const VisibleSets again = build_visible_sets(one, rooms(), places_in_rooms(), coarse()).value();
  CHECK(again.keys == rooms_sets().keys);
  CHECK(again.ends == rooms_sets().ends);
  CHECK(again.bits == rooms_sets().bits);
}

TEST_CASE("visible sets: of a placed cloud in its own frame") {
  const Similarity placed{axis_angle(Vec3d{1, 0, 0}, 0.7), {4, -2, 9}, 2.0};
  std::vector<Vec3d> viewpoints;
  for (const Vec3d& v : places_in_rooms()) viewpoints.push_back(placed * v);
  VisibleSettings settings = coarse();
  settings.cell *= 2;
  settings.margin *= 2;
  settings.near_plane *= 2;
  OpenMPBackend backend(2);
  const VisibleSets sets = build_visible_sets(backend, rooms(), viewpoints, settings, placed).value();
  CHECK(sets.cell == doctest::Approx(0.5));
  CHECK(sets.cells() >= rooms_sets().cells() - 4);
  Camera camera = Camera::look_at(viewpoints[7], viewpoints[8], {0, 1, 0}, 32, 32, 90);
  camera.near_plane = 0.4;
  const auto cell = sets.cell_of(camera, placed);
  REQUIRE(cell);
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<float, OpenMPBackend> renderer(backend, config);
  GaussianSet part = rooms().set(placed);
  part.selection.seen = sets.seen_from(*cell);
  CHECK(psnr(renderer.render(rooms().set(placed), camera).value().rgb,
             renderer.render(part, camera).value().rgb) > 60);
}

TEST_CASE("visible sets: nothing is known elsewhere, nor of cameras that see more") {
  const VisibleSets& sets = rooms_sets();
  const Vec3d eye = places_in_rooms()[10];
  Camera camera = Camera::look_at(eye, eye + Vec3d{1, 0, 0}, {0, 1, 0}, 32, 32, 90);
  REQUIRE(sets.cell_of(camera));
  Camera other = camera;
  other.fx *= 1.01;
  CHECK_FALSE(sets.cell_of(other));
  other = camera;
  other.near_plane = 0.21;
  CHECK_FALSE(sets.cell_of(other));
  other.near_plane = 0.1;
  CHECK(sets.cell_of(other));
  other = camera;
  other.near_sigma = 1;
  CHECK_FALSE(sets.cell_of(other));
  for (const Vec3d& far : {Vec3d{0, 1.3, 0}, Vec3d{-2, 9, 0}, Vec3d{1e300, 0, 0}}) {
    other = Camera::look_at(far, far + Vec3d{1, 0, 0}, {0, 1, 0}, 32, 32, 90);
    CHECK_FALSE(sets.cell_of(other));
  }
}

TEST_CASE(
    "visible sets: where nearly all is seen a sample says so, and sets that are made do not depend on "
    "it") {
  // In the open: small Gaussians on a ring around the viewpoints, which hide nothing of each other.
  GaussianCloudBuilder builder(0);
  Rng rng(3);
  constexpr std::size_t kOnRing = 1024;
  for (std::size_t i = 0; i < kOnRing; ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / kOnRing;
    RawGaussian g;
    g.mean = {12 * std::cos(angle), 1.3 + 0.2 * rng.uniform(-1.0, 1.0), 12 * std::sin(angle)};
    g.quat = {1, 0, 0, 0};
    g.log_scales = {std::log(0.05), std::log(0.05), std::log(0.05)};
    g.opacity_logit = 0;
    builder.add(g);
  }
  GaussianCloud ring = builder.cloud();
  sort_spatially(ring);
  std::vector<Vec3d> eyes;
  for (int i = 0; i < 24; ++i) {
    for (int j = 0; j < 16; ++j) eyes.push_back({0.25 + 0.5 * (i - 12), 1.3, 0.25 + 0.5 * (j - 8)});
  }
  std::vector<Vec3d> indoors = places_in_rooms();
  for (const Vec3d& p : places_in_rooms()) indoors.push_back({p.x, 0.8, p.z});
  for (const int threads : {1, 3}) {
    OpenMPBackend backend(threads);
    VisibleSettings s = coarse();
    double done = 0;
    s.progress = [&](double share) { done = share; };
    const VisibleSets stopped = build_visible_sets(backend, ring, eyes, s).value();
    CHECK(stopped.cells() == 0);
    CHECK(stopped.refused_share > s.most_share);
    CHECK(stopped.refused_share <= 1);
    CHECK(done > 0);
    CHECK(done < 0.5);  // most of the viewpoints are not looked from
    s.most_share = 1;
    const VisibleSets all = build_visible_sets(backend, ring, eyes, s).value();
    CHECK(all.mean_row_share(ring.size()) > 0.9);
    CHECK(all.refused_share == 0);
    CHECK(done == 1.0);
    // Behind walls: far more cells than the sample, most of the cloud hidden from each.
    const VisibleSets asked = build_visible_sets(backend, rooms(), indoors, coarse()).value();
    VisibleSettings never = coarse();
    never.most_share = 1;
    const VisibleSets unasked = build_visible_sets(backend, rooms(), indoors, never).value();
    CHECK(asked.cells() >= 64);
    CHECK(asked.refused_share == 0);
    CHECK(asked.keys == unasked.keys);
    CHECK(asked.ends == unasked.ends);
    CHECK(asked.bits == unasked.bits);
  }
}

TEST_CASE(
    "visible sets: made for a camera they have at least its resolution, and none coarser than asked") {
  const Camera small = Camera::look_at({0, 1, 0}, {1, 1, 0}, {0, 1, 0}, 64, 48, 90);
  Camera large = Camera::look_at({0, 1, 0}, {1, 1, 0}, {0, 1, 0}, 640, 480, 90);
  large.near_plane = 0.1;
  large.near_sigma = 1;
  VisibleSettings s;
  s.serve(small);
  CHECK(s.face == VisibleSettings{}.face);
  s.serve(large);
  CHECK(s.face == 640);
  CHECK(s.near_plane == 0.1);
  CHECK(s.near_sigma == 1);
}

TEST_CASE("visible sets: what cannot be is refused by name") {
  SerialBackend backend;
  const std::vector<Vec3d> eyes{{1, 1, 0}};
  const auto refused = [&](auto change, const char* name) {
    VisibleSettings s = coarse();
    change(s);
    const auto r = build_visible_sets(backend, rooms(), eyes, s);
    CHECK(r.code() == Errc::invalid_argument);
    CHECK(contains(r.message(), name));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](auto& s) { s.cell = 0; }, "cell");
  refused([nan](auto& s) { s.margin = nan; }, "margin");
  refused([](auto& s) { s.min_weight = 1; }, "min_weight");
  refused([](auto& s) { s.rows = 3; }, "rows");
  refused([](auto& s) { s.rows = 64; }, "rows");
  refused([](auto& s) { s.face = 8; }, "face");
  refused([](auto& s) { s.near_plane = 0; }, "near_plane");
  refused([](auto& s) { s.near_sigma = -1; }, "near_sigma");
  refused([](auto& s) { s.most_share = 0; }, "most_share");
  refused([nan](auto& s) { s.most_share = nan; }, "most_share");
  CHECK(contains(build_visible_sets(backend, rooms(), {}, coarse()).message(), "no viewpoint"));
  const std::vector<Vec3d> bad{{1, 1, 0}, {nan, 0, 0}};
  CHECK(contains(build_visible_sets(backend, rooms(), bad, coarse()).message(), "viewpoint 1"));
  GaussianCloud unsorted = rooms();
  unsorted.chunk_bounds.clear();
  CHECK(contains(build_visible_sets(backend, unsorted, eyes, coarse()).message(), "sort_spatially"));
}

TEST_CASE("a cut of what is seen: every chunk that is seen once, nothing that shows none of them") {
  SerialBackend backend;
  const GaussianCloud& cloud = rooms();
  bool shipped = false;
  SUBCASE("built") {}
  SUBCASE("shipped by a set") { shipped = true; }
  const LeveledCloud levels =
      shipped ? join_levels(backend, shipped_levels(cloud, 2), 16).value() : LeveledCloud{};
  const GaussianCloud& shown = shipped ? levels.cloud : cloud;
  const LodTree tree = shipped ? levels.tree : build_lod(backend, cloud).value();
  Rng rng(8);
  for (int i = 0; i < 20; ++i) {
    const Camera camera = random_camera(rng);
    std::vector<std::uint32_t> bits((shown.view().chunk_count() + 31) / 32), list;
    const double share = i % 2 == 0 ? 0.3 : 0.02;
    for (std::uint32_t c = 0; c < shown.view().chunk_count(); ++c) {
      if (rng.uniform(0, 1) >= share) continue;
      list.push_back(c);
      bits[c / 32] |= 1u << (c % 32);
    }
    const View<const std::uint32_t> seen{bits.data(), bits.size()};
    LodChoice choice;
    choice.pixels = 8;
    choice.grain = 1e9;
    choice.hysteresis = 0;
    LodCut all(tree, shown), some(tree, shown);
    all.select(camera, choice);
    some.select(camera, choice, {}, seen);
    // What is drawn is of the whole cut, and of it all that shows something seen: leaves are known by
    // their number.
    for (const std::uint32_t c : some.leaf_chunks()) {
      CHECK(std::binary_search(all.leaf_chunks().begin(), all.leaf_chunks().end(), c));
      if (!shipped) CHECK(std::binary_search(list.begin(), list.end(), c));
    }
    for (const std::uint32_t c : all.leaf_chunks()) {
      if (!std::binary_search(list.begin(), list.end(), c)) continue;
      CHECK(std::binary_search(some.leaf_chunks().begin(), some.leaf_chunks().end(), c));
    }
    for (const std::uint32_t m : some.merged_chunks()) {
      CHECK(std::find(all.merged_chunks().begin(), all.merged_chunks().end(), m) !=
            all.merged_chunks().end());
    }
    CHECK(some.stats().shown <= all.stats().shown);
    std::fill(bits.begin(), bits.end(), 0u);
    CHECK(some.select(camera, choice, {}, seen).empty());
  }
}
