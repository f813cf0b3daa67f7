// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include "gsnav/core/parallel.hpp"
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
  Renderer<float, ToyBackend> renderer(toy, config);
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

TEST_CASE("sort_pairs is a stable sort") {
  Rng rng(3);
  SerialBackend serial;
  for (const std::size_t n : {0u, 1u, 2u, 100u, 20000u}) {
    std::vector<std::uint32_t> keys(n), values(n);
    for (std::size_t i = 0; i < n; ++i) {
      keys[i] = static_cast<std::uint32_t>(rng.next()) & (i % 2 == 0 ? 0xffu : 0xffffffffu);
      values[i] = static_cast<std::uint32_t>(i);
    }
    std::vector<std::uint32_t> expected = values;
    std::stable_sort(expected.begin(), expected.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    Buffer<std::uint32_t, SerialBackend> k(serial), v(serial);
    SortScratch<SerialBackend> scratch(serial);
    k.upload(keys.data(), n);
    v.upload(values.data(), n);
    sort_pairs(serial, k, v, scratch);
    CHECK(std::equal(expected.begin(), expected.end(), v.data()));
  }
}
