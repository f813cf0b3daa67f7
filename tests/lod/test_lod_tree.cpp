// SPDX-License-Identifier: Apache-2.0
// The tree keeps what it merges, a cut shows each Gaussian once, and both are the same every time.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/backends/serial.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "lod_support.hpp"
#include "support/compiled_frames.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Mass, and mass times mean, of rows [first, end).
struct Moments {
  double mass = 0;
  Vec3d first{};
};
Moments moments(const GaussianCloud& c, std::size_t first, std::size_t end) {
  Moments out;
  for (std::size_t i = first; i < std::min(end, c.size()); ++i) {
    const double s[3] = {c.scales[0][i], c.scales[1][i], c.scales[2][i]};
    const double area =
        std::sqrt(s[0] * s[0] * s[1] * s[1] + s[1] * s[1] * s[2] * s[2] + s[2] * s[2] * s[0] * s[0]);
    const double mass = static_cast<double>(c.opacities[i]) * area;
    out.mass += mass;
    out.first = out.first + c.mean(i) * mass;
  }
  return out;
}

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
bool same(const LodTree& a, const LodTree& b) {
  bool equal = a.level_begin == b.level_begin && a.nodes.size() == b.nodes.size();
  for (std::size_t k = 0; k < 3; ++k)
    equal = equal && same(a.merged.means[k], b.merged.means[k]) &&
            same(a.merged.scales[k], b.merged.scales[k]);
  for (std::size_t k = 0; k < 4; ++k) equal = equal && same(a.merged.quats[k], b.merged.quats[k]);
  equal = equal && same(a.merged.opacities, b.merged.opacities) && same(a.merged.sh0, b.merged.sh0) &&
          same(a.merged.shN, b.merged.shN);
  for (std::size_t i = 0; equal && i < a.nodes.size(); ++i)
    equal = a.nodes[i].error == b.nodes[i].error && a.nodes[i].grain == b.nodes[i].grain;
  return equal;
}

/// How often each leaf is shown by a cut.
std::vector<int> shown(const LodTree& tree, const LodCut& cut) {
  std::vector<int> out(tree.leaves());
  for (const std::uint32_t c : cut.leaf_chunks()) ++out[c];
  for (const std::uint32_t m : cut.merged_chunks()) {
    std::size_t node = m + tree.leaves(), level = 1;
    while (node >= tree.level_begin[level + 1]) ++level;
    const std::size_t first = (node - tree.level_begin[level]) << level;
    for (std::size_t leaf = first; leaf < std::min(first + (std::size_t{1} << level), tree.leaves());
         ++leaf)
      ++out[leaf];
  }
  return out;
}

}  // namespace

TEST_CASE("lod tree: every level has the mass and the centre of the cloud") {
  SerialBackend backend;
  for (const int count : {1, 255, 256, 257, 700, 5000}) {
    CAPTURE(count);
    // So faint that none covers another: then masses add up.
    GaussianCloud cloud = small_wall(3, count);
    for (float& o : cloud.opacities) o *= 1e-4f;
    const LodTree tree = build_lod(backend, cloud).value();
    const Moments all = moments(cloud, 0, cloud.size());
    REQUIRE(tree.nodes.size() == tree.level_begin.back());
    for (std::size_t l = 1; l < tree.levels(); ++l) {
      const std::size_t first = (tree.level_begin[l] - tree.leaves()) * kProjectChunk;
      const std::size_t end = (tree.level_begin[l + 1] - tree.leaves()) * kProjectChunk;
      const Moments m = moments(tree.merged, first, end);
      CHECK(m.mass == doctest::Approx(all.mass).epsilon(1e-4));
      for (int k = 0; k < 3; ++k) CHECK(std::abs(m.first[k] - all.first[k]) < 1e-4 * all.mass);
    }
    CHECK(tree.level_begin.back() - tree.level_begin[tree.levels() - 1] == 1);
  }
}

TEST_CASE("lod tree: a node has half of its children's Gaussians, errors grow, bounds hold all below") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(4, 6000);
  const LodTree tree = build_lod(backend, cloud).value();
  const GaussianCloud& m = tree.merged;
  for (std::size_t l = 1; l < tree.levels(); ++l) {
    for (std::size_t node = tree.level_begin[l]; node < tree.level_begin[l + 1]; ++node) {
      const std::size_t i = node - tree.level_begin[l], first = tree.level_begin[l - 1] + 2 * i;
      for (std::size_t child = first; child < std::min<std::size_t>(first + 2, tree.level_begin[l]);
           ++child) {
        CHECK(tree.nodes[node].error >= tree.nodes[child].error);
        for (int k = 0; k < 3; ++k) {
          CHECK(tree.nodes[node].reach.low[k] <= tree.nodes[child].reach.low[k]);
          CHECK(tree.nodes[node].reach.high[k] >= tree.nodes[child].reach.high[k]);
        }
      }
      const std::size_t row = (node - tree.leaves()) * kProjectChunk;
      for (std::size_t r = row; r < row + kProjectChunk; ++r) {
        for (int k = 0; k < 3; ++k) {
          CHECK(m.mean(r)[k] >= tree.nodes[node].reach.low[k]);
          CHECK(m.mean(r)[k] <= tree.nodes[node].reach.high[k]);
        }
      }
    }
  }
  CHECK(validate(m.set()).ok());
}

TEST_CASE("lod tree: grain is the geometric mean size of the cloud's Gaussians below a node, by mass") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(14, 3000);
  const LodTree tree = build_lod(backend, cloud).value();
  for (std::size_t l = 0; l < tree.levels(); ++l) {
    for (std::size_t node = tree.level_begin[l]; node < tree.level_begin[l + 1]; ++node) {
      const std::size_t first = ((node - tree.level_begin[l]) << l) * kProjectChunk;
      long double mass = 0, log_size = 0;
      for (std::size_t i = first; i < std::min(first + (kProjectChunk << l), cloud.size()); ++i) {
        const Moments m = moments(cloud, i, i + 1);
        mass += m.mass;
        log_size += m.mass * 0.5L * std::log(static_cast<long double>(m.mass) / cloud.opacities[i]);
      }
      CHECK(tree.nodes[node].grain ==
            doctest::Approx(static_cast<double>(std::exp(log_size / mass))).epsilon(1e-6));
    }
  }
  GaussianCloud empty = small_wall(15, 300);
  std::fill(empty.opacities.begin(), empty.opacities.end(), 0.0f);
  for (const LodNode& n : build_lod(backend, empty).value().nodes) CHECK(n.grain == 0);
}

TEST_CASE("lod cut: the larger Gaussians are for a pixel, the less is merged") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(16, 20000);
  const LodTree tree = build_lod(backend, cloud).value();
  LodChoice choice;
  choice.hysteresis = 0;
  for (const int side : {32, 64, 128, 256, 512}) {
    CAPTURE(side);
    const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, side, side, 60);
    LodCut cut(tree, cloud), without(tree, cloud);
    static_cast<void>(cut.select(camera, choice));
    LodChoice any = choice;
    any.grain = 1e9;
    static_cast<void>(without.select(camera, any));
    CHECK(cut.stats().merged <= without.stats().merged);
    // What is drawn, by the definition: its error and its error times grain, in pixels at its nearest.
    const auto p = make_projection_camera<double>(camera, LodCut::photo_set(cloud, choice));
    for (const std::uint32_t m : cut.merged_chunks()) {
      const LodNode& n = tree.nodes[m + tree.leaves()];
      const double pixels = p.fx / std::max(n.reach.low.z - 1e-4, 0.2);
      CHECK(static_cast<double>(n.error) * pixels <= choice.pixels * 1.001);
      const double area = static_cast<double>(n.error) * static_cast<double>(n.grain) * pixels * pixels;
      CHECK(area <= choice.pixels * choice.grain * 1.001);
    }
  }
  choice.grain = 0;
  CHECK(validate(choice).message().find("grain") != std::string::npos);
}

TEST_CASE("lod cut: cameras in a box share a cut that is fine enough for each of them") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(17, 20000);
  const LodTree tree = build_lod(backend, cloud).value();
  LodChoice choice;
  choice.grain = 4;
  Rng rng(5);
  std::uint64_t merged = 0, checked = 0;
  for (int round = 0; round < 12; ++round) {
    CAPTURE(round);
    const Vec3d low{rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-4, 3)};
    const Aabb<double> box{low, low + Vec3d{0.5, 0.5, 0.5}};
    const int width = round % 2 == 0 ? 32 : 96, height = 64;
    const auto camera_in_box = [&] {
      const Vec3d eye{rng.uniform(box.low.x, box.high.x), rng.uniform(box.low.y, box.high.y),
                      rng.uniform(box.low.z, box.high.z)};
      const Vec3d to{rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1)};
      return Camera::look_at(eye, eye + to, {0.1, -1, 0.05}, width, height, 60 + 3.0 * round);
    };
    LodCut cut(tree, cloud);
    static_cast<void>(cut.select_from(box, camera_in_box(), choice));
    for (const int n : shown(tree, cut)) CHECK(n == 1);
    merged += cut.stats().merged;
    for (int c = 0; c < 10; ++c) {
      const Camera camera = camera_in_box();
      for (const std::uint32_t m : cut.merged_chunks()) {
        const LodNode& n = tree.nodes[m + tree.leaves()];
        // The point of the node that is largest in the image is nearest: random points, by the
        // definition.
        for (int k = 0; k < 20; ++k) {
          Vec3d p;
          for (int i = 0; i < 3; ++i)
            p[i] =
                rng.uniform(static_cast<double>(n.reach.low[i]), static_cast<double>(n.reach.high[i]));
          const Vec3d seen = camera.viewmat.linear * p + camera.viewmat.translation;
          const double x = camera.fx * seen.x / seen.z + camera.cx,
                       y = camera.fy * seen.y / seen.z + camera.cy;
          if (seen.z < 0.2 || x < 0 || y < 0 || x > width || y > height) continue;
          ++checked;
          const double pixels = std::max(camera.fx, camera.fy) / seen.z;
          REQUIRE(static_cast<double>(n.error) * pixels <= choice.pixels * 1.001);
          REQUIRE(static_cast<double>(n.error) * static_cast<double>(n.grain) * pixels * pixels <=
                  choice.pixels * choice.grain * 1.001);
        }
      }
    }
  }
  CHECK(merged > 0);
  CHECK(checked > 1000);
}

TEST_CASE("lod tree: the same bits for any number of threads") {
  const GaussianCloud cloud = small_wall(5, 9000);
  SerialBackend serial;
  const LodTree one = build_lod(serial, cloud).value();
  for (const int threads : {1, 2, 5}) {
    OpenMPBackend backend(threads);
    CHECK(same(one, build_lod(backend, cloud).value()));
  }
}

TEST_CASE("lod tree: progress comes to 1, and what cannot be is named") {
  SerialBackend backend;
  GaussianCloud cloud = small_wall(6, 3000);
  double last = 0;
  bool rises = true;
  LodSettings settings;
  settings.progress = [&](double share) {
    rises = rises && share > last;
    last = share;
  };
  CHECK(build_lod(backend, cloud, settings).ok());
  CHECK(rises);
  CHECK(last == 1);
  settings.neighbours = 0;
  CHECK(build_lod(backend, cloud, settings).message().find("neighbours = 0") != std::string::npos);
  settings = {};
  settings.sh_degree = 4;
  CHECK(build_lod(backend, cloud, settings).message().find("sh_degree = 4") != std::string::npos);
  cloud.chunk_bounds.clear();
  CHECK(build_lod(backend, cloud).code() == Errc::invalid_argument);
  CHECK(build_lod(backend, GaussianCloud{}).value().nodes.empty());
}

TEST_CASE("lod cut: each Gaussian in view is shown once, the others not twice") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(7, 12000);
  const LodTree tree = build_lod(backend, cloud).value();
  Rng rng(8);
  LodCut cut(tree, cloud);
  for (int run = 0; run < 60; ++run) {
    const Vec3d eye{2 * rng.uniform(-1, 1), 2 * rng.uniform(-1, 1), rng.uniform(-6, 3.5)};
    const Camera camera =
        Camera::look_at(eye, {rng.uniform(-2, 2), rng.uniform(-2, 2), 4}, {0, -1, 0}, 64, 64, 60);
    LodChoice choice;
    choice.pixels = std::exp(rng.uniform(-3, 2));
    static_cast<void>(cut.select(camera, choice));
    const auto p = make_projection_camera<double>(camera, LodCut::photo_set(cloud, choice));
    const std::vector<int> times = shown(tree, cut);
    std::uint64_t covered = 0;
    for (std::size_t leaf = 0; leaf < times.size(); ++leaf) {
      CHECK(times[leaf] <= 1);
      if (times[leaf] == 0) CHECK(!may_be_visible(p, cloud.chunk_bounds[leaf]));
      covered += times[leaf] == 1 ? std::min(kProjectChunk, cloud.size() - leaf * kProjectChunk) : 0;
    }
    CHECK(cut.stats().shown == covered);
  }
}

TEST_CASE("lod cut: the finest is the cloud itself, bit for bit") {
  const GaussianCloud cloud = small_wall(9, 5000);
  OpenMPBackend backend(2);
  const LodTree tree = build_lod(backend, cloud).value();
  LodCut cut(tree, cloud);
  LodChoice choice;
  choice.pixels = 1e-9;
  const Camera camera = Camera::look_at({0.3, 0, 0}, {0, 0, 4}, {0, -1, 0}, 96, 64, 60);
  BasicRenderer<float, OpenMPBackend> renderer(backend);
  const auto a = renderer.render(cut.select(camera, choice), std::span(&camera, 1)).value();
  const auto b = renderer.render(LodCut::photo_set(cloud, choice), camera).value();
  CHECK(a.rgb == b.rgb);
  CHECK(a.median_depth == b.median_depth);
  CHECK(cut.merged_chunks().empty());
}

TEST_CASE(
    "lod cut: hysteresis keeps levels where a camera rests, and depends on the past only through it") {
  SerialBackend backend;
  const GaussianCloud cloud = small_wall(10, 20000);
  const LodTree tree = build_lod(backend, cloud).value();
  const auto at = [](double z) { return Camera::look_at({0, 0, z}, {0, 0, 4}, {0, -1, 0}, 64, 64, 60); };
  LodChoice choice;
  choice.pixels = 0.4;
  int changes_with = 0, changes_without = 0;
  for (double start = -3; start < 1; start += 0.25) {
    const auto count_changes = [&](double hysteresis) {
      LodCut cut(tree, cloud);
      LodChoice c = choice;
      c.hysteresis = hysteresis;
      int changes = 0;
      std::vector<std::uint32_t> before;
      for (int i = 0; i < 12; ++i) {
        static_cast<void>(cut.select(at(start + (i % 2 == 0 ? 0.05 : -0.05)), c));
        changes += i > 1 && before != cut.merged_chunks() ? 1 : 0;
        before = cut.merged_chunks();
      }
      return changes;
    };
    changes_with += count_changes(0.1);
    changes_without += count_changes(0);
  }
  CHECK(changes_with == 0);
  CHECK(changes_without > 0);
  LodCut first(tree, cloud), second(tree, cloud);
  for (const double z : {-3.0, 0.0, 1.0, -1.0}) {
    static_cast<void>(first.select(at(z), choice));
    static_cast<void>(second.select(at(z), choice));
    CHECK(first.merged_chunks() == second.merged_chunks());
  }
  first.reset();
  LodCut fresh(tree, cloud);
  static_cast<void>(first.select(at(-1.5), choice));
  static_cast<void>(fresh.select(at(-1.5), choice));
  CHECK(first.merged_chunks() == fresh.merged_chunks());
}
