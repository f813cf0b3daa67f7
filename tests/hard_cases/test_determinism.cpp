// SPDX-License-Identifier: Apache-2.0
// N63, N65: the same input gives the same bits, however the work is cut.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

#include "hard_cases/arrays.hpp"
#include "hard_cases/cases.hpp"
#include "support/image_hashes.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

template <class S>
std::uint64_t hash_of(const std::vector<S>& v, std::uint64_t h) {
  for (const S& x : v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof x);
    h = (h ^ bits) * 0x100000001b3ull;  // FNV-1a by words
  }
  return h;
}

/// Of the images of camera c alone.
template <class S>
std::uint64_t hash_of(const Frames<S>& f, std::size_t c) {
  const auto part = [&](const std::vector<S>& image) {
    const std::size_t n = image.size() / f.cameras;
    return std::vector<S>(image.begin() + static_cast<std::ptrdiff_t>(c * n),
                          image.begin() + static_cast<std::ptrdiff_t>((c + 1) * n));
  };
  std::uint64_t h = 0xcbf29ce484222325ull;
  for (const auto* image : {&f.rgb, &f.alpha, &f.median_depth, &f.expected_depth, &f.accumulated_depth,
                            &f.first_hit_depth}) {
    h = hash_of(part(*image), h);
  }
  return h;
}

std::vector<Camera> cameras(std::size_t count) {
  std::vector<Camera> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 0.03 * static_cast<double>(i);
    out.push_back(Camera::look_at({x, 0.5 * x, 0}, {0, 0, 4}, {0, -1, 0}, 24, 18, 70));
  }
  return out;
}

/// Rows [from, to) of a cloud without origins.
GaussianCloud rows(const GaussianCloud& c, std::size_t from, std::size_t to) {
  GaussianCloud out = c;
  const auto cut = [&](std::vector<float>& plane) {
    const std::size_t width = plane.size() / c.size();
    plane = std::vector<float>(plane.begin() + static_cast<std::ptrdiff_t>(from * width),
                               plane.begin() + static_cast<std::ptrdiff_t>(to * width));
  };
  for (auto& p : out.means) cut(p);
  for (auto& p : out.quats) cut(p);
  for (auto& p : out.scales) cut(p);
  cut(out.opacities);
  cut(out.sh0);
  cut(out.shN);
  return out;
}

}  // namespace

TEST_CASE("N63_determinism_100") {
  const GaussianCloud a = random_cloud(63, {.count = 1100, .needle = 0.1, .scale = 0.05});
  const GaussianCloud b = needle_cloud(630, 30);
  // Sanitized, with emulated device code, fewer cameras (more than a word of 32) and runs.
  const std::vector<Camera> all = cameras(kSanitized ? 40 : 64);
  std::vector<std::uint64_t> reference_float;
  for_each_backend([&](auto& renderer) {
    using R = std::remove_reference_t<decltype(renderer)>;
    // One renderer, so that scratch is used again, over batches of all sizes.
    using B = std::remove_cvref_t<decltype(renderer.backend())>;
    const GaussianArrays<B> first(renderer.backend(), a), second(renderer.backend(), b);
    const std::vector<GaussianSet> sets{first.set(), second.set()};
    BasicRenderer<typename R::scalar, B> r(renderer.backend(), all_outputs());
    std::vector<std::uint64_t> one;
    for (std::size_t c = 0; c < all.size(); ++c) {
      const auto f = r.render(sets, std::span(&all[c], 1)).value();
      record_hashes(f, renderer.name());
      one.push_back(hash_of(f, 0));
    }
    for (const std::size_t batch : {std::size_t{7}, all.size()}) {
      std::size_t differ = 0;
      for (std::size_t from = 0; from < all.size(); from += batch) {
        const std::size_t n = std::min(batch, all.size() - from);
        const auto f = r.render(sets, std::span(&all[from], n)).value();
        for (std::size_t c = 0; c < n; ++c) differ += hash_of(f, c) != one[from + c] ? 1 : 0;
      }
      CHECK(differ == 0);
    }
    std::size_t differ = 0;
    for (int run = 0; run < (kSanitized ? 10 : 100); ++run) {
      differ += hash_of(r.render(sets, std::span(&all[5], 1)).value(), 0) != one[5] ? 1 : 0;
    }
    CHECK(differ == 0);
    if (!R::is_float) return;
    if (reference_float.empty()) reference_float = one;
    CHECK(one == reference_float);
  });
}

TEST_CASE("N63_determinism_100 of work that is cut") {
  // Enough Gaussians for binning in blocks, one a thread.
  const GaussianCloud cloud = random_cloud(631, {.count = 9000, .scale = 0.03});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 100, 71, 75);
  for (const Exponential profile : {Exponential::exact, Exponential::fast}) {
    RenderConfig config = all_outputs();
    config.quality.exponential = profile;
    CaseRenderer<float, SerialBackend> serial("serial");
    const auto reference = serial.render({&cloud}, camera, config);
    REQUIRE(reference.stats[0].visible >= 4096);
    for_each_backend([&](auto& renderer) {
      using R = std::remove_reference_t<decltype(renderer)>;
      if constexpr (R::is_float) {
        const auto images = renderer.render({&cloud}, camera, config);
        // A GPU's `fast` has an exponential of its own (Exp2::hardware).
        const bool own = profile == Exponential::fast &&
                         !is_host_backend<std::remove_cvref_t<decltype(renderer.backend())>>;
        CHECK(same_images(own ? renderer.render({&cloud}, camera, config) : reference, images));
      }
    });
#if defined(_OPENMP)
    for (const int threads : {2, 7}) {
      CaseRenderer<float, OpenMPBackend> renderer("openmp", threads);
      CHECK(same_images(reference, renderer.render({&cloud}, camera, config)));
    }
#endif
  }
}

TEST_CASE("N65_cull_invariance") {
  // Where a set is cut into chunks does not show: rows that are never seen before, between and behind.
  const GaussianCloud cloud = random_cloud(65, {.count = 2600, .needle = 0.2});
  const GaussianCloud unseen = random_cloud(650, {.count = 700, .center = {0, 0, -4}});
  REQUIRE(unseen.size() > 500);
  GaussianCloud padded = rows(unseen, 0, 333);
  REQUIRE(append(padded, rows(cloud, 0, 1000)).ok());
  REQUIRE(append(padded, rows(unseen, 333, 334)).ok());
  REQUIRE(append(padded, rows(cloud, 1000, 2000)).ok());
  REQUIRE(append(padded, rows(unseen, 334, unseen.size())).ok());
  REQUIRE(append(padded, rows(cloud, 2000, cloud.size())).ok());
  const Camera camera = axis_camera();
  for_each_renderer([&](auto& renderer) {
    const auto reference = renderer.render({&cloud}, camera, all_outputs());
    const auto f = renderer.render({&padded}, camera, all_outputs());
    if (!f.stats.empty()) CHECK(f.stats[0].visible == reference.stats[0].visible);
    CHECK(same_images(f, reference));
  });
}
