// SPDX-License-Identifier: Apache-2.0
// N21 to N24: which Gaussian is in front.
#include <doctest/doctest.h>

#include "hard_cases/backends.hpp"
#include "hard_cases/cases.hpp"
#include "support/oracle.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

/// depth_key of every Gaussian in lanes of L, bits.
template <class L>
std::vector<std::uint32_t> keys_of(const GaussianCloud& cloud, const Camera& camera, const Similarity& place) {
  constexpr int kLanes = LaneIo<L>::width;
  const auto p = make_projection_camera<float>(camera, cloud.set(place));
  const Vec3<float> o = vec_cast<float>(-p.position);
  const Vec3<L> offset{L(o.x), L(o.y), L(o.z)};
  std::vector<std::uint32_t> keys;
  for (std::size_t i = 0; i < cloud.size(); i += kLanes) {
    float mean[3][kLanes];
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t row = std::min(i + l, cloud.size() - 1);
      for (std::size_t k = 0; k < 3; ++k) mean[k][l] = cloud.means[k][row];
    }
    const L key = depth_key(p.key_rotation, p.key_scale,
                            Vec3<L>{LaneIo<L>::load(mean[0]), LaneIo<L>::load(mean[1]), LaneIo<L>::load(mean[2])},
                            offset);
    double out[kLanes];
    LaneIo<L>::store(key, out);
    for (std::size_t l = 0; l < kLanes && i + l < cloud.size(); ++l) {
      keys.push_back(bits_of(static_cast<float>(out[l])));
    }
  }
  return keys;
}

/// The key by hand: the chain of fused operations that every backend shares, written out.
std::vector<std::uint32_t> keys_by_hand(const GaussianCloud& cloud, const Camera& camera,
                                        const Similarity& place) {
  const auto p = make_projection_camera<double>(camera, cloud.set(place));
  const Mat3d r = camera.viewmat.linear * rotation_matrix(place.rotation);
  const float rx = static_cast<float>(r(2, 0)), ry = static_cast<float>(r(2, 1)), rz = static_cast<float>(r(2, 2));
  std::vector<std::uint32_t> keys;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float x = cloud.means[0][i] + static_cast<float>(-p.position.x);
    const float y = cloud.means[1][i] + static_cast<float>(-p.position.y);
    const float z = cloud.means[2][i] + static_cast<float>(-p.position.z);
    const float key = std::fma(rz, z, std::fma(ry, y, rx * x)) * static_cast<float>(place.scale);
    keys.push_back(bits_of(key));
  }
  return keys;
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
  const std::size_t center = 32 * 65 + 32;
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
    const auto grid = [&](double low, double high) { return std::floor(rng.uniform(low, high) * 4096) / 4096; };
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
      const auto reference = keys_by_hand(cloud, camera, p);
      CHECK(keys_of<float>(cloud, camera, p) == reference);
      CHECK(keys_of<Pack<float, 4>>(cloud, camera, p) == reference);
      CHECK(keys_of<Pack<float, 8>>(cloud, camera, p) == reference);
      CHECK(keys_of<Pack<float, 16>>(cloud, camera, p) == reference);
    }
  }
  // Along the axis the key is the stored z itself: ties are exact, and file order settles them.
  const auto keys = keys_of<float>(cloud, axis, {});
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
  // Tilted a little, the depths of a plane are apart by roundings: the key's are the ones that order.
  Camera tilted = turned;
  tilted.viewmat.linear = rotation_matrix(axis_angle(normalized(Vec3d{1, -2, 0.5}), 2e-5));
  render_everywhere({&cloud}, tilted, all_outputs(), [](const auto& f, const auto&) { CHECK(all_finite(f)); });
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
    gs.push_back(gaussian({rng.uniform(-1, 1) * z, rng.uniform(-1, 1) * z, z}, {2e4, 2e4, 2e4}, 0.5, {1, 1, 2}));
  }
  const GaussianCloud cloud = cloud_of(gs);
  RenderConfig config = all_outputs();
  const Camera camera = axis_camera(96, 48);
  for_each_renderer([&](auto& renderer) {
    config.key_bits = 32;
    const auto full = renderer.render({&cloud}, camera, config);
    config.key_bits = 24;
    const double psnr = image_error(renderer.render({&cloud}, camera, config).rgb, full.rgb, 3).psnr;
    CHECK(psnr >= 80);
    config.key_bits = 16;
    const double few = image_error(renderer.render({&cloud}, camera, config).rgb, full.rgb, 3).psnr;
    MESSAGE(renderer.name() << ": key of 24 bits " << psnr << " dB, of 16 bits " << few << " dB");
  });
  // What is compared is the key from the near plane on, to 2^16 times as far and beyond: never out of order.
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
    // Distances are rounded by themselves: one just below the near plane is the nearest, not the farthest.
    if (bits < 32) CHECK(code(std::nextafter(0.2f, 0.0f)) == 0);
    CHECK(code(std::nextafter(0.2f, 0.0f)) <= code(0.2f));
  }
}

TEST_CASE("N24_neg_zero_depth") {
  GaussianCloud cloud = random_cloud(24, {.count = 400, .sh_degree = 0});
  Camera camera = axis_camera();
  camera.near_plane = 1e-30;  // behind it lies only what has no depth at all
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
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
  render_everywhere({&cloud}, camera, all_outputs(), [](const auto& f, const auto&) { CHECK(all_finite(f)); });
  for_each_renderer([&](auto& renderer) {
    const auto all = renderer.render({&cloud}, camera, all_outputs());
    const auto some = renderer.render({&rest}, camera, all_outputs());
    CHECK(all.stats[0].visible == some.stats[0].visible);
    CHECK(all.rgb == some.rgb);
    CHECK(all.median_depth == some.median_depth);
    CHECK(all.expected_depth == some.expected_depth);
  });
}
