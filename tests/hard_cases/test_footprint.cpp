// SPDX-License-Identifier: Apache-2.0
// N11, N18, N19: which pixels a Gaussian covers.
#include <doctest/doctest.h>

#include <algorithm>

#include "eval/oracle_support.hpp"
#include "gsnav/detail/math/pack_columns.hpp"
#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/records.hpp"
#include "hard_cases/truth.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

constexpr int kColumns = 61, kRows = 47;  // no multiple of a tile

Camera footprint_camera() {
  Camera c = axis_camera(kColumns, 40);
  c.height = kRows;
  c.cy = 0.4 * kRows;
  return c;
}

/// 1: alpha is above the threshold beyond rounding; 0: below it; -1: within 1e-4 of it, or of the line
/// where an exact response goes behind the camera.
template <class Truth>
std::vector<int> covered_pixels(const Truth& truth, Real opacity) {
  std::vector<int> covered(kColumns * kRows, 0);
  const Real low = opacity * 255 / 0.9999L, high = opacity * 255 / 1.0001L;
  if (low < 1) return covered;
  const Real q_low = 2 * std::log(low), q_high = high < 1 ? -1 : 2 * std::log(high);
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      const Real q = truth.q(x + 0.5L, y + 0.5L);
      int& c = covered[static_cast<std::size_t>(y * kColumns + x)];
      if (q >= 0 && q <= q_low) c = q <= q_high ? 1 : -1;
      if constexpr (requires { truth.at_horizon(Real(), Real()); }) {
        if (truth.at_horizon(x + 0.5L, y + 0.5L)) c = -1;
      }
    }
  }
  return covered;
}

/// Pixels of [x0, x1) x [y0, y1) that are surely covered.
std::size_t count_covered(const std::vector<int>& covered, int x0, int y0, int x1, int y1) {
  std::size_t n = 0;
  for (int y = y0; y < std::min(y1, kRows); ++y) {
    for (int x = x0; x < std::min(x1, kColumns); ++x) {
      n += covered[static_cast<std::size_t>(y * kColumns + x)] == 1 ? 1 : 0;
    }
  }
  return n;
}

struct CoverCounts {
  std::size_t tiles = 0, pixels = 0;        ///< covered ones that were left out
  std::size_t extra_tiles = 0, listed = 0;  ///< listed ones without a covered pixel, and all
  std::size_t extra_pixels = 0;             ///< drawn below the threshold
};

/// Tile lists and the pixel test of one splat against what is truly covered.
template <class S>
void count_errors(const std::vector<int>& covered, bool drawn, const RecordMaker<S>& r,
                  const RenderConfig& config, CoverCounts& counts) {
  const std::size_t total = count_covered(covered, 0, 0, kColumns, kRows);
  if (!drawn) {
    counts.tiles += total;
    counts.pixels += total;
    return;
  }
  const BlendRules<S> rules = blend_rules<S>(config);
  const bool elliptic = config.response == Response::ewa;
  for (const int size : {8, 16, 32}) {
    const TileGrid grid = TileGrid::of(kColumns, kRows, size);
    std::size_t inside = 0;
    for_each_tile(grid, r.geometry(), r.bounds(), rules.log2_alpha_min, elliptic, [&](std::size_t tile) {
      const int x = static_cast<int>(tile) % grid.columns * size;
      const int y = static_cast<int>(tile) / grid.columns * size;
      const std::size_t n = count_covered(covered, x, y, x + size, y + size);
      inside += n;
      ++counts.listed;
      counts.extra_tiles += n == 0 ? 1 : 0;
    });
    counts.tiles += total - inside;
  }
  const SplatRecords<S> records{&r.geometry(), nullptr, nullptr, &r.perspective()};
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      const S px = S(x) + S(0.5), py = S(y) + S(0.5);
      BlendState<S, DepthMode::none> state;
      const bool hit =
          elliptic
              ? blend_splat<false, DepthMode::none, Exp2::degree5, false>(state, rules, records, px, py)
              : blend_splat<false, DepthMode::none, Exp2::degree5, true>(state, rules, records, px, py);
      const int truth = covered[static_cast<std::size_t>(y * kColumns + x)];
      counts.pixels += truth == 1 && !hit ? 1 : 0;
      counts.extra_pixels += truth == 0 && hit ? 1 : 0;
    }
  }
}

template <class S>
CoverCounts cover_counts(const GaussianCloud& cloud, const RenderConfig& config) {
  const Camera camera = footprint_camera();
  RecordMaker<S> maker(cloud, camera, config);
  CoverCounts counts;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const TruthSplat splat = truth_of(cloud, i);
    const Truth2d ewa = truth_project(splat, camera, config.response == Response::ewa);
    std::vector<int> covered;
    switch (config.response) {
      case Response::ewa:
        covered = covered_pixels(ewa, ewa.opacity);
        break;
      case Response::tangent_plane:
        covered = covered_pixels(TruthTangent(splat, camera), ewa.opacity);
        break;
      case Response::ray:
        covered = covered_pixels(TruthRay(splat, camera), ewa.opacity);
        break;
    }
    const bool drawn = maker.project(i);
    count_errors(covered, drawn, maker, config, counts);
  }
  return counts;
}

template <class S>
void check_cover(const GaussianCloud& cloud, Response response, const std::string& name) {
  RenderConfig config;
  config.response = response;
  const CoverCounts counts = cover_counts<S>(cloud, config);
  CHECK(counts.tiles == 0);
  CHECK(counts.pixels == 0);
  CHECK(counts.extra_pixels == 0);
  MESSAGE(name << ": " << cloud.size() << " splats, " << counts.extra_tiles << " of " << counts.listed
               << " tiles listed without need");
}

}  // namespace

TEST_CASE("N11_tile_cover_conservative") {
  SUBCASE("no tile and no pixel of a footprint is missed") {
    const GaussianCloud cloud = needle_cloud(11, sample_count(20000));
    check_cover<float>(cloud, Response::ewa, "ewa float");
    const GaussianCloud some = needle_cloud(12, sample_count(2000));
    check_cover<double>(some, Response::ewa, "ewa double");
    check_cover<float>(some, Response::tangent_plane, "tangent_plane float");
    check_cover<float>(some, Response::ray, "ray float");
    check_cover<double>(some, Response::ray, "ray double");
  }
  SUBCASE("a principal point far off loses no pixel that passes the test") {
    const RenderConfig config;
    const BlendRules<float> rules = blend_rules<float>(config);
    std::size_t passed = 0, lost = 0;
    for (const double far_off : {3000.0, -32000.0, 32000.0, 200000.0}) {
      Camera camera = footprint_camera();
      camera.fx = camera.fy = std::abs(far_off);  // a part cut out of a large image
      camera.cx += far_off;
      camera.cy -= 0.7 * far_off;
      // From a fraction of a pixel to a few.
      Rng rng(17);
      std::vector<RawGaussian> gs;
      for (int i = 0; i < 600; ++i) {
        const double x = rng.uniform(0, kColumns), y = rng.uniform(0, kRows), z = rng.uniform(2, 6);
        const double scale = z / camera.fx * std::exp(rng.uniform(-2, 1.5));
        gs.push_back(gaussian({(x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z},
                              {scale, scale, scale}, 0.9));
      }
      const GaussianCloud cloud = cloud_of(gs);
      RecordMaker<float> maker(cloud, camera, config);
      const TileGrid grid = TileGrid::of(kColumns, kRows, 8);
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (!maker.project(i)) continue;
        std::vector<char> listed(grid.count(), 0);
        for_each_tile(grid, maker.geometry(), maker.bounds(), rules.log2_alpha_min, true,
                      [&](std::size_t tile) { listed[tile] = 1; });
        const SplatRecords<float> records{&maker.geometry(), nullptr, nullptr, &maker.perspective()};
        for (int y = 0; y < kRows; ++y) {
          for (int x = 0; x < kColumns; ++x) {
            BlendState<float, DepthMode::none> state;
            if (!blend_splat<false, DepthMode::none, Exp2::degree5, false>(
                    state, rules, records, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f))
              continue;
            ++passed;
            lost += listed[static_cast<std::size_t>(y / 8 * grid.columns + x / 8)] == 0 ? 1 : 0;
          }
        }
      }
    }
    CHECK(passed > 10000);
    CHECK(lost == 0);
  }
  SUBCASE("blocks of a tile are found by lanes as by the scalar") {
    const GaussianCloud cloud = needle_cloud(13, 2000);
    RecordMaker<float> maker(cloud, footprint_camera(), {});
    const float log2_alpha_min = static_cast<float>(std::log2(1.0 / 255));
    Rng rng(14);
    std::size_t differences = 0, covered = 0;
    std::vector<SplatGeometry<float>> splats;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (maker.project(i)) splats.push_back(maker.geometry());
    }
    for (std::size_t first = 0; first + 16 <= splats.size(); first += 16) {
      const float x0 = static_cast<float>(rng.below(kColumns - 16)) + 0.5f, x1 = x0 + 15;
      const float y0 = static_cast<float>(rng.below(kRows - 16)) + 0.5f, y1 = y0 + 15;
      const float low = y0 + static_cast<float>(rng.below(12)),
                  high = low + static_cast<float>(rng.below(4));
      const auto compare = [&]<int N>() {
        using P = Pack<float, N>;
        P c[8];
        load_columns<8>(&splats[first].ref_x, c);
        const FootprintStrips<P> strips({c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]}, log2_alpha_min,
                                        P(x0), P(x1), P(y0), P(y1));
        P left, right;
        const std::uint32_t lanes = lane_bits(strips.columns(P(low), P(high), left, right));
        for (std::size_t l = 0; l < static_cast<std::size_t>(N); ++l) {
          const FootprintStrips<float> strip(splats[first + l], log2_alpha_min, x0, x1, y0, y1);
          float own_left, own_right;
          const bool hit = strip.columns(low, high, own_left, own_right);
          differences += ((lanes >> l) & 1u) != (hit ? 1u : 0u) ? 1 : 0;
          if (!hit) continue;
          ++covered;
          const int lane = static_cast<int>(l);
          differences += left[lane] != own_left || right[lane] != own_right ? 1 : 0;
        }
      };
      compare.template operator()<4>();
      compare.template operator()<8>();
      compare.template operator()<16>();
    }
    CHECK(covered > 100);
    CHECK(differences == 0);
  }
}

TEST_CASE("N11_tile_cover_conservative in images: tiles of any size give the same bits") {
  const GaussianCloud a = needle_cloud(15, 400);
  const GaussianCloud b = random_cloud(16, {.count = 1500, .needle = 0.3});
  for (const Response response : {Response::ewa, Response::tangent_plane, Response::ray}) {
    RenderConfig config = all_outputs();
    config.response = response;
    for_each_renderer([&](auto& renderer) {
      config.tuning.tile_size = 16;
      const auto reference = renderer.render({&a, &b}, footprint_camera(), config);
      for (const int size : {8, 32}) {
        config.tuning.tile_size = size;
        const auto f = renderer.render({&a, &b}, footprint_camera(), config);
        CHECK(f.rgb == reference.rgb);
        CHECK(f.alpha == reference.alpha);
        CHECK(f.median_depth == reference.median_depth);
        CHECK(f.expected_depth == reference.expected_depth);
      }
    });
  }
}

TEST_CASE("N11_tile_cover_conservative in images: few needles at a time have the oracle's alpha") {
  RenderConfig config;
  config.outputs = kAlpha;
  config.tuning.tile_size = 8;  // six rows of tiles: more than a short list of them holds
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    GaussianCloud cloud = needle_cloud(150 + seed, 10);
    for (float& o : cloud.opacities) o *= 0.5f;  // one that is lost is missed behind all others, too
    const eval::OracleFrames truth = oracle({cloud.set()}, footprint_camera());
    const std::vector<bool> undecided(truth.undecided.begin(), truth.undecided.end());
    render_everywhere({&cloud}, footprint_camera(), config, [&](const auto& f, const auto& renderer) {
      const double worst = image_error(f.alpha, truth.alpha, 1, undecided).max;
      MESSAGE(renderer.name() << ": alpha is off by " << worst);
      CHECK(worst < renderer.bound(2e-5, 1e-9));
    });
  }
}

TEST_CASE("N18_screen_filling") {
  const Camera camera = axis_camera();
  RenderConfig config = all_outputs();
  config.tuning.tile_size = 16;
  for (const double sigma_px : {5000.0, 1e5, 1e8}) {
    CAPTURE(sigma_px);
    const double sigma = sigma_px * 2 / 64;
    const GaussianCloud cloud = cloud_of({gaussian({0.1, -0.2, 2}, {sigma, sigma, 0.01}, 0.5)});
    const Truth2d truth = truth_project(truth_of(cloud, 0), camera);
    render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto& renderer) {
      double worst = 0;
      for (std::size_t p = 0; p < f.alpha.size(); ++p) {
        const Real x = static_cast<Real>(p % kAxisSize) + 0.5L,
                   y = static_cast<Real>(p / kAxisSize) + 0.5L;
        worst = std::max(
            worst, std::abs(static_cast<double>(f.alpha[p]) - static_cast<double>(truth.alpha(x, y))));
      }
      CHECK(worst < renderer.bound(1e-6, 1e-12));
      if (!f.stats.empty()) CHECK(f.stats[0].tile_intersections == 16);  // all tiles
    });
  }
}

TEST_CASE("N19_offscreen_rod_fan") {
  // A rod of 3 m x 1 cm, its centre at twice the half field of view, turned to every side.
  Camera centred;
  centred.set_hfov(96, 72, 90);
  Camera shifted = centred;  // the Jacobian's limits follow the principal point
  shifted.cx = 20.5;
  Rng rng(19);
  double ewa_inside = 0, true_inside = 0;
  int fans = 0;
  for (int round = 0; round < 150; ++round) {
    const Camera& camera = round % 2 == 0 ? centred : shifted;
    RawGaussian g = gaussian({2 * 1.5, rng.uniform(-1, 1), 1.5}, {1, 0.01 / 3, 0.01 / 3},
                             0.99);  // 3 m: +- 1.5 sigma
    g.quat = random_rotation(rng);
    const GaussianCloud cloud = cloud_of({g});
    const TruthSplat splat = truth_of(cloud, 0);
    const Truth2d contract = truth_project(splat, camera);
    const TruthRay ray(splat, camera);
    double largest_ray = 0, largest_contract = 0;
    std::vector<double> expected, expected_ray;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        expected.push_back(static_cast<double>(contract.alpha(x + 0.5L, y + 0.5L)));
        expected_ray.push_back(static_cast<double>(ray.alpha(x + 0.5L, y + 0.5L)));
        largest_contract = std::max(largest_contract, expected.back());
        largest_ray = std::max(largest_ray, expected_ray.back());
      }
    }
    const auto error = [](const auto& alpha, const std::vector<double>& truth) {
      double worst = 0;
      for (std::size_t p = 0; p < truth.size(); ++p) {
        if (std::abs(truth[p] * 255 - 1) < 1e-3) continue;
        const double t = truth[p] * 255 < 1 ? 0 : truth[p];
        worst = std::max(worst, std::abs(static_cast<double>(alpha[p]) - t));
      }
      return worst;
    };
    render_everywhere({&cloud}, camera, all_outputs(), [&](const auto& f, const auto& renderer) {
      CHECK(error(f.alpha, expected) < renderer.bound(1e-4, 1e-9));
    });
    RenderConfig config = all_outputs();
    config.response = Response::ray;
    render_everywhere({&cloud}, camera, config, [&](const auto& f, const auto& renderer) {
      CHECK(error(f.alpha, expected_ray) < renderer.bound(1e-4, 1e-9));
      if (largest_ray <= 1.0 / 255) {
        CHECK(*std::max_element(f.alpha.begin(), f.alpha.end()) <= 1.0f / 255);
      }
    });
    if (largest_ray <= 1.0 / 255 && largest_contract > 1.0 / 255) {
      ++fans;
      ewa_inside = std::max(ewa_inside, largest_contract);
    }
    true_inside = std::max(true_inside, largest_ray);
  }
  MESSAGE(fans << " of 150 rods are drawn by the contract's clamped Jacobian where none is; alpha up to "
               << ewa_inside << "; the true largest of all is " << true_inside);
}
