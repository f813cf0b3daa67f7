// SPDX-License-Identifier: Apache-2.0
// N21 to N24, N77 to N80: which Gaussian is in front.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gsnav/detail/math/pack_double.hpp"
#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "hard_cases/truth.hpp"
#include "support/oracle.hpp"
#include "support/sanitized.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// Keys of one Gaussian as z_depth and camera_distance order it.
struct Keys {
  std::vector<std::uint32_t> depth, distance;
  bool operator==(const Keys&) const = default;
};

/// origin - camera position of a row, asset frame.
Vec3d offset_of(const GaussianCloud& cloud, const Vec3d& eye, std::size_t row) {
  return (cloud.origins.empty() ? Vec3d{}
                                : cloud.origins[cloud.origin_ids.empty() ? 0 : cloud.origin_ids[row]]) -
         eye;
}

/// The kernel's keys of every Gaussian, one after the other, bits.
Keys keys_of(const GaussianCloud& cloud, const Camera& camera, const Similarity& place) {
  const auto p = make_projection_camera<double>(camera, cloud.set(place));
  Keys keys;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d mean{cloud.means[0][i], cloud.means[1][i], cloud.means[2][i]};
    const Vec3d delta = mean + offset_of(cloud, p.position, i);
    keys.depth.push_back(bits_of(static_cast<float>(depth_key(p, delta))));
    keys.distance.push_back(bits_of(static_cast<float>(distance_key(p, delta))));
  }
  return keys;
}

/// The same in N lanes.
template <int N>
Keys keys_in_lanes(const GaussianCloud& cloud, const Camera& camera, const Similarity& place) {
  constexpr std::size_t kLanes = N;
  using D = Pack<double, N / 2>;
  const auto p = make_projection_camera<double>(camera, cloud.set(place));
  Keys keys;
  for (std::size_t i = 0; i < cloud.size(); i += kLanes) {
    Vec3<Pack<float, N>> mean;
    double offset[3][kLanes];
    float planes[3][kLanes];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t row = std::min(i + l, cloud.size() - 1);
      const Vec3d o = offset_of(cloud, p.position, row);
      for (int k = 0; k < 3; ++k) {
        planes[k][l] = cloud.means[static_cast<std::size_t>(k)][row];
        offset[k][l] = o[k];
      }
    }
    for (int k = 0; k < 3; ++k) mean[k] = Pack<float, N>::load(planes[k]);
    Vec3<D> low, high;
    for (int k = 0; k < 3; ++k) {
      low[k] = widened<0>(mean[k]) + D::load(offset[k]);
      high[k] = widened<1>(mean[k]) + D::load(offset[k] + kLanes / 2);
    }
    float depth[kLanes], distance[kLanes];
    rounded(depth_key(p, low), depth_key(p, high)).store(depth);
    rounded(distance_key(p, low), distance_key(p, high)).store(distance);
    for (std::size_t l = 0; l < kLanes && i + l < cloud.size(); ++l) {
      keys.depth.push_back(bits_of(depth[l]));
      keys.distance.push_back(bits_of(distance[l]));
    }
  }
  return keys;
}

/// The centre of row i in camera axes, metres, in long double: by the text of the contract.
std::array<Real, 3> true_center(const GaussianCloud& cloud, const Camera& camera,
                                const Similarity& place, std::size_t i) {
  const Real w = place.rotation.w, x = place.rotation.x, y = place.rotation.y, z = place.rotation.z;
  const Real turn[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  const Vec3d origin = offset_of(cloud, {}, i);
  Real asset[3], world[3];
  for (int k = 0; k < 3; ++k)
    asset[k] = Real(cloud.means[static_cast<std::size_t>(k)][i]) + Real(origin[k]);
  for (int k = 0; k < 3; ++k) {
    world[k] = place.scale * (turn[k][0] * asset[0] + turn[k][1] * asset[1] + turn[k][2] * asset[2]) +
               place.translation[k];
  }
  std::array<Real, 3> center;
  for (int k = 0; k < 3; ++k) {
    const Vec3d& row = camera.viewmat.linear.row[k];
    center[static_cast<std::size_t>(k)] =
        row.x * world[0] + row.y * world[1] + row.z * world[2] + camera.viewmat.translation[k];
  }
  return center;
}

Keys true_keys(const GaussianCloud& cloud, const Camera& camera, const Similarity& place) {
  Keys keys;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto c = true_center(cloud, camera, place, i);
    keys.depth.push_back(bits_of(static_cast<float>(c[2])));
    keys.distance.push_back(
        bits_of(static_cast<float>(std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]))));
  }
  return keys;
}

/// A camera that is turned about no axis of the world's.
Camera turned_camera(const Vec3d& eye, const Vec3d& target, int size, double hfov) {
  return Camera::look_at(eye, target, normalized(Vec3d{0.3, 1, -0.2}), size, size, hfov);
}

/// `count` Gaussians about 100 m in front of `axis_camera`, on the grid of a 16-bit capture (1/256 m):
/// all but `apart` in one plane, over several of the lattice's origins. `moved` is a multiple of the
/// grid's step.
GaussianCloud coarse_capture(std::size_t count, std::size_t apart, const Vec3d& moved = {}) {
  Rng rng(71);
  std::vector<RawGaussian> gs;
  const auto grid = [&](double low, double high) {
    return std::floor(rng.uniform(low, high) * 256) / 256;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 96 + (i % 6 == 5 && i / 6 < apart ? grid(0, 0.1) : 0.0);
    const Vec3d at{grid(-45, 45), grid(-45, 45), z};
    const std::array<float, 3> color{static_cast<float>(rng.normal()), static_cast<float>(rng.normal()),
                                     static_cast<float>(rng.normal())};
    gs.push_back(gaussian(at + moved, {2, 2, 0.1}, rng.uniform(0.1, 0.9), color));
  }
  return cloud_of(gs);
}

/// The cloud without rows `dropped`.
GaussianCloud without(const GaussianCloud& cloud, const std::vector<bool>& dropped) {
  GaussianCloud out = cloud;
  const auto filter = [&](std::vector<float>& plane, std::size_t width) {
    std::vector<float> kept;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (dropped[i]) continue;
      for (std::size_t k = 0; k < width; ++k) kept.push_back(plane[width * i + k]);
    }
    plane = kept;
  };
  for (auto& p : out.means) filter(p, 1);
  for (auto& p : out.quats) filter(p, 1);
  for (auto& p : out.scales) filter(p, 1);
  filter(out.opacities, 1);
  filter(out.sh0, 3);
  return out;
}

}  // namespace

TEST_CASE("N21_depth_tie_stack") {
  Rng rng(21);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 64; ++i) {
    gs.push_back(gaussian({0, 0, 3}, {0.3, 0.3, 0.01}, 0.1,
                          {static_cast<float>(rng.normal()), static_cast<float>(i % 7), 1}));
  }
  const GaussianCloud cloud = cloud_of(gs);
  // Blended in file order by hand, in double.
  double transmittance = 1, color[3] = {};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double alpha = cloud.opacities[i];
    for (std::size_t k = 0; k < 3; ++k) {
      color[k] += alpha * transmittance * std::max(0.0, 0.5 + kSh0 * cloud.sh0[3 * i + k]);
    }
    transmittance *= 1 - alpha;
  }
  const std::size_t center = kAxisPixel;
  render_everywhere({&cloud}, axis_camera(), all_outputs(), [&](const auto& f, const auto& renderer) {
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(static_cast<double>(f.rgb[3 * center + k]) ==
            doctest::Approx(color[k]).epsilon(renderer.bound(2e-6, 1e-12)));
    }
  });
  // A second set's rows come after the first's, however the stack is split.
  std::vector<RawGaussian> front(gs.begin(), gs.begin() + 20), back(gs.begin() + 20, gs.end());
  const GaussianCloud first = cloud_of(front), second = cloud_of(back);
  for_each_renderer([&](auto& renderer) {
    const auto whole = renderer.render({&cloud}, axis_camera(), all_outputs());
    CHECK(renderer.render({&first, &second}, axis_camera(), all_outputs()).rgb == whole.rgb);
    CHECK(renderer.render({&cloud}, axis_camera(), all_outputs()).rgb == whole.rgb);
    CHECK(renderer.render({&second, &first}, axis_camera(), all_outputs()).rgb != whole.rgb);
  });
}

TEST_CASE("N22_depth_tie_grid") {
  // Positions on SPZ's grid of 1/4096 m: whole planes of equal depth.
  Rng rng(22);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 3000; ++i) {
    const auto grid = [&](double low, double high) {
      return std::floor(rng.uniform(low, high) * 4096) / 4096;
    };
    const double z = 3 + std::floor(rng.uniform(0, 8)) / 4096;
    gs.push_back(gaussian({grid(-1, 1), grid(-1, 1), z}, {0.05, 0.05, 0.02}, 0.3,
                          {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 0}));
  }
  const GaussianCloud cloud = cloud_of(gs);
  const Camera axis = axis_camera(48, 48);
  Camera turned = axis;
  turned.viewmat.linear = rotation_matrix(axis_angle(normalized(Vec3d{1, -2, 0.5}), 0.3));
  turned.viewmat.translation = {0.1, -0.2, 0.3};
  Similarity place;
  place.rotation = axis_angle(Vec3d{0, 0, 1}, 0.4);
  place.scale = 1.7;
  for (const Camera& camera : {axis, turned}) {
    for (const Similarity& p : {Similarity{}, place}) {
      const Keys reference = true_keys(cloud, camera, p);
      CHECK(keys_of(cloud, camera, p) == reference);
      CHECK(keys_in_lanes<4>(cloud, camera, p) == reference);
      CHECK(keys_in_lanes<8>(cloud, camera, p) == reference);
      CHECK(keys_in_lanes<16>(cloud, camera, p) == reference);
    }
  }
  // Along the axis the key is the stored z itself: ties are exact, and file order settles them.
  const auto keys = keys_of(cloud, axis, {}).depth;
  std::size_t ties = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    CHECK(keys[i] == bits_of(cloud.means[2][i]));
    ties += i > 0 && keys[i] == keys[i - 1] ? 1 : 0;
  }
  CHECK(ties > 100);
  const OracleImage truth = oracle_render({&cloud}, axis);
  render_everywhere({&cloud}, axis, all_outputs(), [&](const auto& f, const auto& renderer) {
    CHECK(image_error(f.rgb, truth.rgb, 3, truth.undecided).max < renderer.bound(2e-5, 1e-9));
  });
  // Tilted a little, the depths of a plane are apart by roundings.
  Camera tilted = turned;
  tilted.viewmat.linear = rotation_matrix(axis_angle(normalized(Vec3d{1, -2, 0.5}), 2e-5));
  const OracleImage of_tilted = oracle_render({&cloud}, tilted);
  render_everywhere({&cloud}, tilted, all_outputs(), [&](const auto& f, const auto& renderer) {
    CHECK(image_error(f.rgb, of_tilted.rgb, 3, of_tilted.undecided).max < renderer.bound(2e-5, 1e-9));
  });
}

TEST_CASE("N23_key_wide_range") {
  // A floor a metre away, and a sky that training pushed out to 1e5 m.
  Rng rng(23);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < 4000; ++i) {
    gs.push_back(gaussian({rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(0.7, 1.5)},
                          {0.03, 0.03, 0.003}, rng.uniform(0.2, 0.95),
                          {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 0}));
  }
  for (int i = 0; i < 300; ++i) {
    const double z = 1e5 * rng.uniform(0.5, 2);
    gs.push_back(
        gaussian({rng.uniform(-1, 1) * z, rng.uniform(-1, 1) * z, z}, {2e4, 2e4, 2e4}, 0.5, {1, 1, 2}));
  }
  const GaussianCloud cloud = cloud_of(gs);
  RenderConfig config = all_outputs();
  const Camera camera = axis_camera(96, 48);
  for_each_renderer([&](auto& renderer) {
    config.quality.key_bits = 32;
    const auto full = renderer.render({&cloud}, camera, config);
    config.quality.key_bits = 24;
    const double psnr = image_error(renderer.render({&cloud}, camera, config).rgb, full.rgb, 3).psnr;
    CHECK(psnr >= 80);
    config.quality.key_bits = 16;
    const double few = image_error(renderer.render({&cloud}, camera, config).rgb, full.rgb, 3).psnr;
    MESSAGE(renderer.name() << ": key of 24 bits " << psnr << " dB, of 16 bits " << few << " dB");
  });
}

TEST_CASE("N23_key_wide_range of codes: never out of order") {
  // What is compared is the key from the near plane on, to 2^16 times as far and beyond.
  for (const int bits : {8, 16, 20, 24, 27, 30, 31, 32}) {
    const KeyCode code = KeyCode::of(bits, 0.2f);
    std::uint32_t last = 0;
    bool ascending = true, fits = true;
    for (float z = std::nextafter(0.2f, 1.0f); z < 1e38f; z *= 1.01f) {
      ascending = ascending && code(z) >= last;
      fits = fits && (bits == 32 || code(z) < (std::uint64_t{1} << bits));
      last = code(z);
    }
    CHECK(ascending);
    CHECK(fits);
    // Distances are rounded by themselves: one just below the near plane is the nearest, not the
    // farthest.
    if (bits < 32) CHECK(code(std::nextafter(0.2f, 0.0f)) == 0);
    CHECK(code(std::nextafter(0.2f, 0.0f)) <= code(0.2f));
  }
}

TEST_CASE("N80_two_scales: sets in the order of depth, or of distance") {
  // Wide Gaussians over a wide image, where depth and distance differ by a third. The camera is at the
  // origin, so that a set keeps its image when it is placed larger, and its centres move away.
  Rng rng(74);
  const Camera camera = [] {
    Camera c;
    c.set_hfov(40, 30, 100);
    return c;
  }();
  const auto some = [&rng] {
    std::vector<RawGaussian> gs;
    for (int i = 0; i < 14; ++i) {
      const double z = rng.uniform(2, 4);
      gs.push_back(gaussian({rng.uniform(-1, 1) * z, rng.uniform(-0.7, 0.7) * z, z}, {z, z, 0.1}, 0.25,
                            {static_cast<float>(rng.normal()), static_cast<float>(rng.normal()), 0}));
      gs.back().quat = random_rotation(rng);
    }
    return cloud_of(gs);
  };
  const GaussianCloud small = some(), large = some();
  constexpr double kScale = 1.5;
  struct Layer {
    Real key;
    Truth2d shape;
    Real red;
  };
  std::vector<double> reds[2];
  for (const SortOrder order : {SortOrder::z_depth, SortOrder::camera_distance}) {
    std::vector<Layer> layers;
    for (const auto& [cloud, scale] : {std::pair{&small, 1.0}, std::pair{&large, kScale}}) {
      for (std::size_t i = 0; i < cloud->size(); ++i) {
        const Vec3d at = cloud->mean(i) * scale;
        layers.push_back({order == SortOrder::z_depth ? at.z : norm(at),
                          truth_project(truth_of(*cloud, i), camera),
                          std::max(0.0L, 0.5L + static_cast<Real>(kSh0) * cloud->sh0[3 * i])});
      }
    }
    std::sort(layers.begin(), layers.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
    std::vector<double>& red = reds[order == SortOrder::z_depth ? 0 : 1];
    std::vector<bool> undecided;
    for (int p = 0; p < camera.width * camera.height; ++p) {
      Real sum = 0, transmittance = 1;
      bool at_threshold = false;
      for (const Layer& l : layers) {
        const Real alpha = l.shape.alpha(p % camera.width + 0.5L, p / camera.width + 0.5L);
        at_threshold = at_threshold || std::abs(alpha * 255 - 1) < 1e-3L;
        if (alpha * 255 < 1) continue;
        sum += alpha * transmittance * l.red;
        transmittance *= 1 - alpha;
      }
      REQUIRE(transmittance > 1e-4L);
      red.push_back(static_cast<double>(sum));
      undecided.push_back(at_threshold);
    }
    RenderConfig config;
    config.sort_order = order;
    const Placed placed(&large, {{}, {}, kScale});
    render_everywhere({&small, placed}, camera, config, [&](const auto& f, const auto& renderer) {
      double worst = 0;
      for (std::size_t p = 0; p < red.size(); ++p) {
        if (!undecided[p]) worst = std::max(worst, std::abs(static_cast<double>(f.rgb[3 * p]) - red[p]));
      }
      CHECK(worst < renderer.bound(1e-5, 1e-9));
    });
  }
  // The orders differ, and so do the images.
  double apart = 0;
  for (std::size_t p = 0; p < reds[0].size(); ++p)
    apart = std::max(apart, std::abs(reds[0][p] - reds[1][p]));
  CHECK(apart > 0.01);
}

TEST_CASE("N24_neg_zero_depth") {
  GaussianCloud cloud = random_cloud(24, {.count = 400, .sh_degree = 0});
  Camera camera = axis_camera();
  camera.near_plane = 1e-30;  // behind it lies only what has no depth at all
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  const std::vector<float> depths{-0.0f, 0.0f, -1e-45f, -1e-38f, -1e-7f, -3.0f, nan, -nan, -inf, 1e-40f};
  std::vector<bool> dropped(cloud.size(), false);
  for (std::size_t i = 0; i < 10 * depths.size(); ++i) {
    const std::size_t row = 3 * i + 1;
    cloud.means[2][row] = depths[i % depths.size()];
    dropped[row] = true;
  }
  // NaN across the view axis, and NaN or infinite shapes that no reader lets through.
  cloud.means[0][2] = nan;
  cloud.means[1][5] = inf;
  cloud.opacities[8] = nan;
  for (const std::size_t row : {2u, 5u, 8u}) dropped[row] = true;
  const GaussianCloud rest = without(cloud, dropped);
  render_everywhere({&cloud}, camera, all_outputs(),
                    [](const auto& f, const auto&) { CHECK(all_finite(f)); });
  for_each_renderer([&](auto& renderer) {
    const auto all = renderer.render({&cloud}, camera, all_outputs());
    const auto some = renderer.render({&rest}, camera, all_outputs());
    if (!all.stats.empty()) CHECK(all.stats[0].visible == some.stats[0].visible);
    CHECK(all.rgb == some.rgb);
    CHECK(all.median_depth == some.median_depth);
    CHECK(all.expected_depth == some.expected_depth);
  });
}

TEST_CASE("N77_quantised_capture keeps its order at any place") {
  // Builds for sanitizers run device code on the host too, slowly.
  constexpr std::size_t kRows = kSanitized ? 6000 : 120000;
  const GaussianCloud cloud = coarse_capture(kRows, kRows / 6);
  CHECK(cloud.origins.size() > 2);
  const Camera axis = axis_camera(12, 12);
  // Nearly level: the plane's depths differ by float32 roundings across the image.
  Camera tilted = axis;
  tilted.viewmat.linear = rotation_matrix(axis_angle(normalized(Vec3d{1, -2, 0.5}), 2e-6));
  tilted.viewmat.translation = {0.1, -0.2, 0.3};
  {
    const Keys keys = keys_of(cloud, axis, {});
    const std::uint32_t plane = bits_of(96.0f);
    CHECK(std::count(keys.depth.begin(), keys.depth.end(), plane) >=
          static_cast<std::ptrdiff_t>(kRows / 6 * 5));
  }
  for (const Camera& camera : {axis, tilted}) {
    const OracleImage truth = oracle_render({&cloud}, camera);
    render_everywhere({&cloud}, camera, {}, [&](const auto& f, const auto& renderer) {
      const ImageError error = image_error(f.rgb, truth.rgb, 3, truth.undecided);
      MESSAGE(renderer.name() << ": " << error.psnr << " dB, max " << error.max);
      CHECK(error.max < renderer.bound(2e-5, 1e-9));
    });
    // The same capture elsewhere: a multiple of the lattice, no multiple of it, and off the grid.
    for (const Vec3d& moved : {Vec3d{64, -128, 64}, Vec3d{1000, 1000, -1000}, Vec3d{0.3, 0.3, 0.3}}) {
      CAPTURE(moved.x);
      const bool off_grid = moved.x < 1;
      const GaussianCloud there = coarse_capture(kRows, kRows / 6, off_grid ? Vec3d{} : moved);
      Similarity place;
      if (off_grid) place.translation = moved;
      Camera from = camera;
      from.viewmat.translation = camera.viewmat.translation - camera.viewmat.linear * moved;
      CHECK(keys_of(there, from, place) == keys_of(cloud, camera, {}));
      render_everywhere({{&there, place}}, from, {}, [&](const auto& f, const auto& renderer) {
        CHECK(image_error(f.rgb, truth.rgb, 3, truth.undecided).max < renderer.bound(2e-5, 1e-9));
      });
    }
  }
}

TEST_CASE("N78_moved_world keeps the order of depths that float32 tells apart") {
  Rng rng(72);
  std::vector<RawGaussian> here;
  for (int i = 0; i < 20000; ++i) {
    here.push_back(gaussian({rng.uniform(-4, 4), rng.uniform(-1.5, 1.5), rng.uniform(-4, 4)},
                            {0.05, 0.05, 0.05}, 0.5));
  }
  const Camera camera = turned_camera({-3.7, 0.4, -3.9}, {1, 0, 1}, 64, 90);
  for (const double metres : {1000.0, 64.0, 0.3}) {
    CAPTURE(metres);
    const Vec3d moved{metres, -metres, metres};
    std::vector<RawGaussian> there = here;
    for (RawGaussian& g : there) g.mean += moved;
    const GaussianCloud cloud = cloud_of(there);
    Camera from = camera;
    from.viewmat.translation = camera.viewmat.translation - camera.viewmat.linear * moved;
    const std::vector<std::uint32_t> keys = keys_of(cloud, from, {}).depth;
    // Where they stood before, in double, from near to far.
    std::vector<std::pair<Real, std::size_t>> order;
    for (std::size_t i = 0; i < here.size(); ++i) {
      const Vec3d c = camera.viewmat.linear * here[i].mean + camera.viewmat.translation;
      if (c.z > 0.2) order.push_back({c.z, i});
    }
    std::sort(order.begin(), order.end());
    // Stored offsets are rounded where they lie, up to 32 m from an origin an axis; the key where it is.
    std::size_t wrong = 0, told_apart = 0;
    for (std::size_t k = 1; k < order.size(); ++k) {
      const Real far = order[k].first, gap = far - order[k - 1].first;
      if (gap <= far * 0x1p-23L + 3.5L * 64 * 0x1p-24L) continue;
      ++told_apart;
      wrong += keys[order[k - 1].second] < keys[order[k].second] ? 0 : 1;
    }
    CHECK(told_apart > order.size() / 2);
    CHECK(wrong == 0);
  }
}

TEST_CASE("N79_near_ties one step of float32 apart are in order") {
  // Pairs of dots, the farther one first in the file: red is in front, and its depth is the float
  // before.
  constexpr int kSide = 16, kPitch = 4;
  const Camera camera = turned_camera({31.2, 17.3, -33.1}, {0.2, -0.1, 0.3}, kSide * kPitch, 16);
  Rng rng(73);
  std::vector<RawGaussian> gs;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double u = ((i % kSide + 0.5) * kPitch - camera.cx) / camera.fx;
    const double v = ((i / kSide + 0.5) * kPitch - camera.cy) / camera.fy;
    const double z = rng.uniform(44, 54);
    const Vec3d in_camera = Vec3d{u * z, v * z, z} - camera.viewmat.translation;
    const Vec3d mean = transpose(camera.viewmat.linear) * in_camera;
    gs.push_back(gaussian(mean, {0.01, 0.01, 0.01}, 0.95, {-1, -1, 3}));
    gs.push_back(gaussian(mean, {0.01, 0.01, 0.01}, 0.95, {3, -1, -1}));
  }
  GaussianCloud cloud = cloud_of(gs);
  REQUIRE(cloud.origins.size() <= 1);
  const auto key = [&](std::size_t row) {
    return static_cast<float>(true_center(cloud, camera, {}, row)[2]);
  };
  for (std::size_t i = 0; i < cloud.size(); i += 2) {
    const float wanted = std::nextafter(key(i), 1e9f);
    const float away = camera.viewmat.linear(2, 0) > 0 ? 1e9f : -1e9f;
    while (key(i) < wanted) cloud.means[0][i] = std::nextafter(cloud.means[0][i], away);
    REQUIRE(key(i) == wanted);
    REQUIRE(key(i) == std::nextafter(key(i + 1), 1e9f));
  }
  const auto in_order = [&](const auto& f, const auto&) {
    int wrong = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
      const int row = i / kSide * kPitch + kPitch / 2, column = i % kSide * kPitch + kPitch / 2;
      const std::size_t pixel = static_cast<std::size_t>(row * camera.width + column);
      wrong += f.rgb[3 * pixel] > f.rgb[3 * pixel + 2] ? 0 : 1;
    }
    CHECK(wrong == 0);
  };
  render_everywhere({&cloud}, camera, {}, in_order);
  // The same before something faint at 10^12 m: such a range of keys takes 29 bits.
  const Vec3d in_camera = Vec3d{0, 0, 1e12} - camera.viewmat.translation;
  const GaussianCloud far =
      cloud_of({gaussian(transpose(camera.viewmat.linear) * in_camera, {1e11, 1e11, 1e11}, 0.01, {})});
  render_everywhere({&cloud, &far}, camera, {}, in_order);
}
