// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <type_traits>

#include "gsnav/detail/core/parallel.hpp"
#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

TEST_CASE("a third-party backend of six members runs the whole pipeline") {
  const GaussianCloud cloud = random_cloud(20, {.count = 3000});
  const Camera camera = Camera::look_at({0, 0, 0}, {0, 0, 4}, {0, -1, 0}, 97, 64, 70);
  RenderConfig config;
  config.outputs = kRgb | kAlpha | kAnyDepth;
  SerialBackend serial;
  const auto reference = render<float>(serial, {cloud.set()}, camera, config);

  ToyBackend toy;
  const GaussianArrays<ToyBackend> arrays(toy, cloud);
  BasicRenderer<float, ToyBackend> renderer(toy, config);
  const std::vector<GaussianSet> sets{arrays.set()};
  const std::vector<Camera> cameras{camera};
  const auto frames = renderer.render(sets, cameras).value();
  CHECK(frames.rgb == reference.rgb);
  CHECK(frames.median_depth == reference.median_depth);
  CHECK(frames.expected_depth == reference.expected_depth);
  CHECK(toy.copies_to_host > 0);

  SUBCASE("a steady frame allocates nothing") {
    Frames<float> again = frames;
    const int before = toy.allocations;
    CHECK(renderer.render(sets, cameras, again).ok());
    CHECK(toy.allocations == before);
    CHECK(again.rgb == reference.rgb);
  }
}

TEST_CASE("sort_pairs is a stable sort, for any keys, in any number of blocks") {
  Rng rng(3);
  const auto check = [](auto& backend, const std::vector<std::uint32_t>& keys, int bits,
                        const std::vector<std::uint32_t>& expected) {
    using B = std::remove_reference_t<decltype(backend)>;
    const std::size_t n = keys.size();
    std::vector<std::uint32_t> values(n), sorted(n), sorted_keys(n);
    std::iota(values.begin(), values.end(), 0u);
    Buffer<std::uint32_t, B> k(backend), v(backend);
    SortScratch<B> scratch(backend);
    for (int round = 0; round < 2; ++round) {  // the second with scratch that has been used
      k.upload(keys.data(), n);
      v.upload(values.data(), n);
      sort_pairs(backend, k, v, scratch, bits);
      v.download(sorted.data(), n);
      k.download(sorted_keys.data(), n);
      CHECK(sorted == expected);
      CHECK(std::is_sorted(sorted_keys.begin(), sorted_keys.end()));
    }
  };
  SerialBackend serial;
  ToyBackend toy;
  for (const std::size_t n : {0u, 1u, 2u, 100u, 8191u, 8192u, 20000u, 70001u}) {
    CAPTURE(n);
    for (const int bits : {1, 8, 16, 22, 23, 27, 28, 32}) {
      CAPTURE(bits);
      const std::uint32_t mask = 0xffffffffu >> (32 - bits);
      std::vector<std::uint32_t> keys(n), equal(n, mask), high(n), few(n);
      for (std::size_t i = 0; i < n; ++i) {
        keys[i] = static_cast<std::uint32_t>(rng.next()) & (i % 2 == 0 ? 0xffu & mask : mask);
        high[i] = mask - (static_cast<std::uint32_t>(rng.next()) & mask & 0xfu);  // no low digit decides
        few[i] = static_cast<std::uint32_t>(rng.next()) & mask & 0x3ffu;          // fewer bits than said
      }
      for (const auto& k : {keys, equal, high, few}) {
        std::vector<std::uint32_t> expected(n);
        std::iota(expected.begin(), expected.end(), 0u);
        std::stable_sort(expected.begin(), expected.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return k[a] < k[b]; });
        check(serial, k, bits, expected);
        if (bits == 32) check(toy, k, bits, expected);
#if defined(_OPENMP)
        for (const int threads : {2, 3, 9}) {
          OpenMPBackend openmp(threads);
          check(openmp, k, bits, expected);
        }
#endif
      }
    }
  }
}
