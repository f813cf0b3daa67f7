// SPDX-License-Identifier: Apache-2.0
// The oracle's two levels give the same bits; crops, bands and threads change nothing; and the float64
// renderer, with its tiles, gives the same image to rounding.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "eval/oracle_support.hpp"
#include "gsnav/io/scene_file.hpp"
#include "hard_cases/cases.hpp"
#include "support/compiled_frames.hpp"
#include "support/data.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav::eval;
using namespace gsnav_test;

namespace {

constexpr std::array kOrders{OracleOrder::float32_key, OracleOrder::float64, OracleOrder::per_ray};

/// Brute force and boxes, in every order; returns the boxed counts of the first.
OracleCounts check_levels(const std::vector<GaussianSet>& sets, const Camera& camera,
                          OracleConfig config) {
  OracleCounts counts;
  for (const OracleOrder order : kOrders) {
    CAPTURE(static_cast<int>(order));
    config.order = order;
    config.boxed = true;
    const OracleFrames boxed = oracle(sets, camera, config);
    config.boxed = false;
    const OracleFrames brute = oracle(sets, camera, config);
    CHECK(same_images(boxed, brute));
    CHECK(boxed.counts.evaluations == brute.counts.evaluations);
    CHECK(boxed.counts.visible == brute.counts.visible);
    CHECK(boxed.counts.order_flips == brute.counts.order_flips);
    CHECK(boxed.counts.listed <= brute.counts.listed);
    if (order == kOrders[0]) counts = boxed.counts;
  }
  return counts;
}

/// The pixels of `rect` of a whole image.
OracleFrames cut(const OracleFrames& f, const PixelRect& rect) {
  OracleFrames out;
  out.resize(rect.width(), rect.height());
  const auto copy = [&](const auto& from, auto& to, std::size_t channels) {
    for (std::size_t y = 0; y < out.height; ++y) {
      const std::size_t first =
          (y + static_cast<std::size_t>(rect.y0)) * f.width + static_cast<std::size_t>(rect.x0);
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(channels * first), channels * out.width,
                  to.begin() + static_cast<std::ptrdiff_t>(channels * y * out.width));
    }
  };
  copy(f.rgb, out.rgb, 3);
  copy(f.alpha, out.alpha, 1);
  copy(f.median_depth, out.median_depth, 1);
  copy(f.expected_depth, out.expected_depth, 1);
  copy(f.accumulated_depth, out.accumulated_depth, 1);
  copy(f.first_hit_depth, out.first_hit_depth, 1);
  copy(f.undecided, out.undecided, 1);
  copy(f.undecided_depth, out.undecided_depth, 1);
  copy(f.order_flip, out.order_flip, 1);
  return out;
}

/// Two sets, one placed with a rotation and a scale, seen by a camera whose principal point is
/// off-centre.
struct TwoSets {
  GaussianCloud a, b;
  std::vector<GaussianSet> sets;
  Camera camera = Camera::look_at({0.3, -0.2, 0.5}, {0.1, 0.1, 4}, {0, -1, 0.1}, 40, 30, 95);

  explicit TwoSets(int count, std::uint64_t seed = 3)
      : a(random_cloud(seed, {.count = count, .sh_degree = 1})),
        b(random_cloud(seed + 1, {.count = count / 2, .sh_degree = 2, .mip = true})) {
    Similarity place;
    place.rotation = {std::cos(0.4), 0, std::sin(0.4), 0};
    place.scale = 1.5;
    place.translation = {-2, 0.5, -1};
    sets = {a.set(), b.set(place)};
    camera.cx = 14.5;
    camera.near_sigma = 1;
    camera.near_plane = 0.01;
  }
};

}  // namespace

TEST_CASE("oracle: brute force and boxes give the same bits, every kind that cuts, every order") {
  for (const OracleKind kind : {OracleKind::contract, OracleKind::ray}) {
    CAPTURE(static_cast<int>(kind));
    OracleConfig config;
    config.kind = kind;
    const TwoSets two(600);
    check_levels(two.sets, two.camera, config);
    config.rules.sort_order = SortOrder::camera_distance;
    config.rules.quality.max_sh_degree = 0;
    config.rules.quality.key_bits = 20;
    config.rules.quality.alpha_min = 0.01;
    check_levels(two.sets, two.camera, config);
    // The camera among Gaussians: outlines without bounds, means far outside the image.
    const GaussianCloud around = random_cloud(
        8, {.count = 1500, .sh_degree = 0, .needle = 0.4, .scale = 0.2, .center = {0, 0, 0}});
    Camera inside = axis_camera(33, 20);
    inside.near_plane = 0.01;
    check_levels({around.set()}, inside, {.kind = kind});
    const GaussianCloud needles = needle_cloud(5, 2000);
    check_levels({needles.set()}, axis_camera(33, 32), {.kind = kind});
  }
}

TEST_CASE("oracle: brute force and boxes on 20K Gaussians") {
  const GaussianCloud cloud = random_cloud(12, {.count = 20000, .sh_degree = 0, .scale = 0.02});
  const Camera camera = Camera::look_at({0, 0, 1}, {0, 0, 4}, {0, -1, 0}, 160, 120, 70);
  OracleConfig config;
  config.crop = {70, 50, 102, 82};
  const OracleCounts counts = check_levels({cloud.set()}, camera, config);
  CHECK(counts.evaluations > 32 * 32 * 20);
}

TEST_CASE("oracle: a crop of a real scene by brute force") {
  const std::string path = data_file("splats/lacadiere_showroom/2_0");
  if (path.empty()) return;
  const LoadedCloud loaded = io::load_scene(path).value();
  Vec3d center{};
  for (std::size_t i = 0; i < loaded.cloud.size(); i += 997)
    center = center + loaded.cloud.mean(i) * 997.0;
  center = center * (1.0 / static_cast<double>(loaded.cloud.size()));
  const Camera camera = Camera::look_at(center, center + Vec3d{1, 0.4, -0.1}, {0, 0, 1}, 256, 256, 90);
  // 64 pixels and not 1024: every Gaussian is asked at each of them, six times.
  OracleConfig config;
  config.crop = {120, 130, 128, 138};
  const OracleCounts counts = check_levels({loaded.cloud.set()}, camera, config);
  CHECK(counts.evaluations > 0);
}

TEST_CASE("oracle: what negligible alphas leave out of the untruncated image") {
  const TwoSets two(500);
  OracleConfig config;
  config.kind = OracleKind::untruncated;
  const OracleFrames boxed = oracle(two.sets, two.camera, config);
  config.boxed = false;
  const OracleFrames brute = oracle(two.sets, two.camera, config);
  double brightest = 0;
  for (const double v : brute.rgb) brightest = std::max(brightest, v);
  const double n = static_cast<double>(brute.counts.gaussians);
  CHECK(image_error(boxed.alpha, brute.alpha, 1).max <= n * kNegligibleAlpha);
  CHECK(image_error(boxed.rgb, brute.rgb, 3).max <= n * kNegligibleAlpha * 20 * brightest);
  CHECK(boxed.counts.evaluations < brute.counts.evaluations);
  // No thresholds: nothing hangs on them, and something fainter than alpha_min is everywhere.
  CHECK(std::count(brute.undecided.begin(), brute.undecided.end(), 1) == 0);
  CHECK(*std::min_element(brute.alpha.begin(), brute.alpha.end()) > 0);
}

TEST_CASE("oracle: crops, threads and bands of rows change no bit") {
  const TwoSets two(400);
  const PixelRect rect{3, 7, 29, 22};
  for (const OracleKind kind : {OracleKind::contract, OracleKind::untruncated, OracleKind::ray}) {
    OracleConfig config;
    config.kind = kind;
    const OracleFrames whole = oracle(two.sets, two.camera, config);
    SerialBackend serial;
    CHECK(same_images(whole,
                      eval::oracle_render(serial, std::span(two.sets), two.camera, config).value()));
    config.crop = rect;
    CHECK(same_images(cut(whole, rect), oracle(two.sets, two.camera, config)));
  }
  // 12K rows that all 3K Gaussians reach: more pairs than one list of rows holds.
  const GaussianCloud tall = random_cloud(4, {.count = 3000, .sh_degree = 0, .scale = 0.5});
  Camera camera = axis_camera(12000, 3000);
  camera.width = 2;
  camera.cx = 1;
  OracleConfig config;
  const OracleFrames whole = oracle({tall.set()}, camera, config);
  config.crop = {0, 5900, 2, 5950};
  CHECK(same_images(cut(whole, config.crop), oracle({tall.set()}, camera, config)));
  // 2K columns that 800 Gaussians reach: more pairs than are ordered by pixel at once.
  const GaussianCloud wide = random_cloud(5, {.count = 800, .sh_degree = 0, .scale = 0.5});
  camera = axis_camera(2000, 500);
  camera.height = 1;
  camera.cy = 0.5;
  config.order = OracleOrder::per_ray;
  config.crop = {};
  const OracleFrames row = oracle({wide.set()}, camera, config);
  config.crop = {950, 0, 1050, 1};
  CHECK(same_images(cut(row, config.crop), oracle({wide.set()}, camera, config)));
}

TEST_CASE("oracle: the renderer in double gives the same image to rounding") {
  for (const SortOrder sort : {SortOrder::z_depth, SortOrder::camera_distance}) {
    const TwoSets two(600, 21);
    RenderConfig rules = all_outputs();
    rules.sort_order = sort;
    rules.background = {0.3, 0.2, 0.1};
    rules.quality.max_sh_degree = 1;
    if (sort == SortOrder::camera_distance) rules.quality.key_bits = 14;  // ties by the hundred
    SerialBackend serial;
    BasicRenderer<double, SerialBackend> renderer(serial, rules);
    const auto rendered = renderer.render(two.sets, {{two.camera}}).value();
    const OracleFrames f = oracle(two.sets, two.camera, {.rules = rules});
    std::vector<bool> skip(f.alpha.size());
    for (std::size_t p = 0; p < skip.size(); ++p) skip[p] = f.undecided[p] != 0;
    CHECK(image_error(rendered.rgb, f.rgb, 3, skip).max < 1e-11);
    CHECK(image_error(rendered.alpha, f.alpha, 1, skip).max < 1e-11);
    for (std::size_t p = 0; p < skip.size(); ++p) {
      if (skip[p] || f.undecided_depth[p] != 0) continue;
      CHECK(std::abs(rendered.median_depth[p] - f.median_depth[p]) < 1e-9);
      CHECK(std::abs(rendered.expected_depth[p] - f.expected_depth[p]) < 1e-9);
      CHECK(std::abs(rendered.accumulated_depth[p] - f.accumulated_depth[p]) < 1e-9);
      CHECK(std::abs(rendered.first_hit_depth[p] - f.first_hit_depth[p]) < 1e-9);
    }
    CHECK(f.counts.visible <= rendered.stats[0].visible);
  }
}

TEST_CASE("oracle: the renderer's exact response is the ray oracle's, found another way") {
  const TwoSets two(600, 41);
  OracleConfig config;
  config.kind = OracleKind::ray;
  config.order = OracleOrder::float32_key;
  config.rules.background = {0.3, 0.2, 0.1};
  const OracleFrames f = oracle(two.sets, two.camera, config);
  config.rules.response = Response::ray;
  SerialBackend serial;
  BasicRenderer<double, SerialBackend> renderer(serial, config.rules);
  const auto rendered = renderer.render(two.sets, {{two.camera}}).value();
  std::vector<bool> skip(f.alpha.size());
  for (std::size_t p = 0; p < skip.size(); ++p) skip[p] = f.undecided[p] != 0;
  CHECK(image_error(rendered.rgb, f.rgb, 3, skip).max < 1e-9);
  CHECK(image_error(rendered.alpha, f.alpha, 1, skip).max < 1e-9);
}
