// SPDX-License-Identifier: Apache-2.0
// Impossible configurations are refused with the field's name.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <new>
#include <span>
#include <utility>
#include <vector>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "ops/backends.hpp"
#include "support/scenes.hpp"

using namespace gsnav;
using namespace gsnav_test;

namespace {

std::string error_of(const GaussianSet& set, const Camera& camera, const RenderConfig& config) {
  SerialBackend serial;
  BasicRenderer<float, SerialBackend> renderer(serial, config);
  const auto r = renderer.render(set, camera);
  CHECK(r.code() == (r.ok() ? Errc::ok : Errc::invalid_argument));
  return r.message();
}
bool names(const std::string& message, const char* field) {
  INFO(message);
  return message.find(field) != std::string::npos;
}

/// Runs out of memory: by a null pointer, or as operator new does.
class FullBackend : public SerialBackend {
 public:
  explicit FullBackend(bool throws) : throws_(throws) {}
  void* allocate(std::size_t, std::size_t) {
    if (throws_) throw std::bad_alloc();
    return nullptr;
  }

 private:
  bool throws_;
};

}  // namespace

TEST_CASE("the smallest alpha of the contract and its log2 are one number") {
  CHECK(kLog2AlphaMin == std::log2(kAlphaMin));
  CHECK(Quality{}.alpha_min == kAlphaMin);
  CHECK(static_cast<float>(kAlphaMin) == 1.0f / 255.0f);
}

TEST_CASE("a renderer without memory returns an error that says for what") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  Camera camera;
  camera.set_hfov(320, 240, 90);
  for (const bool throws : {false, true}) {
    FullBackend full(throws);
    BasicRenderer<float, FullBackend> renderer(full);
    const auto r = renderer.render(cloud.set(), camera);
    CHECK(r.code() == Errc::out_of_memory);
    for (const char* part : {"320 x 240", "10 Gaussians", "bytes"}) CHECK(names(r.message(), part));
    Buffer<double, FullBackend> buffer(full);
    for (const std::size_t n : {std::size_t{1}, ~std::size_t{0}, ~std::size_t{0} / 9 * 8 + 64}) {
      CHECK_THROWS_AS(buffer.resize_discard(n), Error);
      CHECK(buffer.size() == 0);
    }
  }
}

TEST_CASE("images that no machine holds are refused before they are allocated") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  Camera camera;
  camera.set_hfov(16384, 16384, 90);
  const std::vector<Camera> cameras(20000, camera);  // 100 TB
  SerialBackend serial;
  BasicRenderer<float, SerialBackend> renderer(serial);
  const GaussianSet set = cloud.set();
  const auto r = renderer.render(std::span(&set, 1), cameras);
  CHECK(r.code() == Errc::out_of_memory);
  for (const char* part : {"20000 cameras", "16384 x 16384", "5368709120 bytes"})
    CHECK(names(r.message(), part));
}

TEST_CASE("null spans with a size are refused") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const GaussianSet set = cloud.set();
  const Camera camera;
  SerialBackend serial;
  BasicRenderer<float, SerialBackend> renderer(serial);
  const std::span<const Camera> no_cameras(static_cast<const Camera*>(nullptr), 1);
  const std::span<const GaussianSet> no_sets(static_cast<const GaussianSet*>(nullptr), 1);
  CHECK(renderer.render(std::span(&set, 1), no_cameras).code() == Errc::invalid_argument);
  CHECK(renderer.render(no_sets, std::span(&camera, 1)).code() == Errc::invalid_argument);
  const FrameJob<float> job{};
  std::vector<RenderStats> stats(1);
  CHECK(renderer.render(std::span(&job, 1), stats).code() == Errc::invalid_argument);
  CHECK(renderer.render(std::span(&job, 1), std::span<RenderStats>()).code() == Errc::invalid_argument);
}

TEST_CASE("a renderer that was moved from renders on, and denormals flushed to zero change no bit") {
  const GaussianCloud cloud = random_cloud(1, {.count = 500});
  SerialBackend serial;
  BasicRenderer<float, SerialBackend> renderer(serial);
  const auto before = renderer.render(cloud.set(), Camera{}).value();
  BasicRenderer<float, SerialBackend> other(std::move(renderer));
  CHECK(other.render(cloud.set(), Camera{}).value().rgb == before.rgb);
  CHECK(renderer.render(cloud.set(), Camera{}).value().rgb == before.rgb);
#if defined(__SSE2__)
  const unsigned mode = _mm_getcsr();
  _mm_setcsr(mode | 0x8040u);  // FTZ and DAZ
  const auto flushed = other.render(cloud.set(), Camera{});
  _mm_setcsr(mode);
  CHECK(flushed.value().rgb == before.rgb);
  CHECK(flushed.value().median_depth == before.median_depth);
#endif
}

TEST_CASE("bad render configurations name their field") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    RenderConfig config;
    change(config);
    return error_of(cloud.set(), Camera{}, config);
  };
  CHECK(names(message([](RenderConfig& c) { c.tuning.tile_size = 12; }), "tuning.tile_size"));
  CHECK(names(message([](RenderConfig& c) { c.outputs = 0; }), "outputs"));
  CHECK(names(message([](RenderConfig& c) { c.outputs = 1u << 20; }), "outputs"));
  CHECK(names(message([](RenderConfig& c) { c.quality.max_alpha = 0; }), "quality.max_alpha"));
  CHECK(names(message([](RenderConfig& c) { c.quality.transmittance_min = 1; }),
              "quality.transmittance_min"));
  CHECK(names(message([](RenderConfig& c) { c.first_hit_tau = std::nan(""); }), "first_hit_tau"));
  CHECK(names(message([](RenderConfig& c) { c.background.y = std::nan(""); }), "background"));
  CHECK(names(message([](RenderConfig& c) { c.quality.exponential = static_cast<Exponential>(99); }),
              "quality.exponential = 99"));
  CHECK(names(message([](RenderConfig& c) { c.quality.exponential = static_cast<Exponential>(-1); }),
              "quality.exponential = -1"));
  CHECK(names(message([](RenderConfig& c) { c.sort_order = static_cast<SortOrder>(99); }),
              "sort_order = 99"));
  CHECK(
      names(message([](RenderConfig& c) { c.response = static_cast<Response>(99); }), "response = 99"));
  CHECK(names(message([](RenderConfig& c) { c.compat = static_cast<Compat>(99); }), "compat = 99"));
  CHECK(names(message([](RenderConfig& c) { c.blend_space = static_cast<ColorSpace>(99); }),
              "blend_space = 99"));
  CHECK(names(message([](RenderConfig& c) { c.composite = static_cast<Composite>(99); }),
              "composite = 99"));
  CHECK(message([](RenderConfig&) {}).empty());
}

TEST_CASE("bad cameras name their field") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    Camera camera;
    change(camera);
    return error_of(cloud.set(), camera, {});
  };
  CHECK(names(message([](Camera& c) { c.width = 0; }), "width"));
  CHECK(names(message([](Camera& c) { c.height = 100000; }), "height"));
  CHECK(names(message([](Camera& c) { c.fx = -1; }), "fx"));
  CHECK(names(message([](Camera& c) { c.set_hfov(256, 256, 180); }), "fx"));
  CHECK(message([](Camera& c) { c.set_hfov(256, 256, 179.999); }).empty());
  CHECK(names(message([](Camera& c) { c.fy = std::numeric_limits<double>::infinity(); }), "fy"));
  CHECK(names(message([](Camera& c) { c.near_plane = 0; }), "near_plane"));
  CHECK(names(message([](Camera& c) { c.cx = std::nan(""); }), "cx = nan"));
  CHECK(names(message([](Camera& c) { c.cy = std::numeric_limits<double>::infinity(); }), "cy = inf"));
  CHECK(names(message([](Camera& c) { c.viewmat.linear.row[0] = -c.viewmat.linear.row[0]; }), "mirror"));
  CHECK(names(message([](Camera& c) { std::swap(c.viewmat.linear.row[1], c.viewmat.linear.row[2]); }),
              "mirror"));
  CHECK(names(message([](Camera& c) { c.viewmat.translation.x = std::nan(""); }), "viewmat"));
  CHECK(names(message([](Camera& c) { c.viewmat.linear(0, 0) = 2; }), "viewmat"));
  CHECK(names(message([](Camera& c) { c.viewmat.linear(1, 2) = std::nan(""); }), "viewmat"));
}

TEST_CASE("bad sets name their array") {
  const GaussianCloud cloud = random_cloud(1, {.count = 10});
  const auto message = [&](auto change) {
    GaussianSet set = cloud.set();
    change(set);
    return error_of(set, Camera{}, {});
  };
  CHECK(names(message([](GaussianSet& s) { s.gaussians.shape.means.size = 3; }), "means"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.shape.quats.set(3, {}); }), "quats"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.color.degree = 4; }), "color.degree = 4"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.color.degree = 1; }), "shN"));
  CHECK(names(message([](GaussianSet& s) { s.eps2d = 0; }), "eps2d"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.shape.means.data[1] = nullptr; }),
              "means is null"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.color.sh0.data = nullptr; }), "sh0 is null"));
  CHECK(names(message([](GaussianSet& s) { s.gaussians.row_ids = {nullptr, 10}; }), "row_ids is null"));
  CHECK(names(message([](GaussianSet& s) { s.filter = static_cast<Filter>(99); }), "filter = 99"));
  CHECK(names(message([](GaussianSet& s) { s.color_space = static_cast<ColorSpace>(99); }),
              "color_space = 99"));
  CHECK(names(message([](GaussianSet& s) { s.world_from_asset.scale = -1; }), "world_from_asset"));
}

TEST_CASE("an empty scene shows the background") {
  SerialBackend serial;
  RenderConfig config;
  config.background = {0.25, 0.5, 0.75};
  BasicRenderer<float, SerialBackend> renderer(serial, config);
  Camera camera;
  camera.set_hfov(33, 17, 90);
  const std::vector<Camera> cameras{camera};
  const auto f = renderer.render(std::span<const GaussianSet>{}, cameras).value();
  for (std::size_t p = 0; p < 33 * 17; ++p) {
    CHECK(f.rgb[3 * p] == 0.25f);
    CHECK(f.rgb[3 * p + 2] == 0.75f);
    CHECK(f.alpha[p] == 0.0f);
    CHECK(f.median_depth[p] == 0.0f);
  }
}
